// Smooths the noise of few rays: each traced layer is gathered from neighbours whose blur reaches the pixel.
// Reads: near_light, far_light (premultiplied; a: share of light), layer_state (x, y: rays; z: hit ratio; w: validity),
//   layer_coc (px; near, far), layer_moments (compressed luminance and its square, of the near and the far part), half
//   resolution.
// Writes: near_smooth, far_smooth (as near_light and far_light), half resolution.
// Method: poster, 2.2: a circular gather scaled by CoC, here one radius a layer, so that what is in focus behind blur
// stays sharp. Samples whose CoC is smaller than their distance are rejected. The accumulated variance, pooled over the
// kernel, says how much of the neighbours' spread is noise, and so how much to take from them (Lee 1980): nothing in
// converged regions. Rings lie at most two texels apart and turn each frame, so the finest level of detail serves. The
// barrel's cut is left out: it would change which neighbours serve, a fifth of the CoC away, not what they are.
#include "shared/frame.glsl"
#include "lib/kernel.glsl"
#include "lib/reconstruct.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_near_light;
uniform sampler2D in_far_light;
uniform sampler2D in_layer_state;
uniform sampler2D in_layer_coc;
uniform sampler2D in_layer_moments;
layout(rgba16f) uniform writeonly image2D out_near_smooth;
layout(rgba16f) uniform writeonly image2D out_far_smooth;

const float FEWEST_SHARE = 1e-4;  // below any hit of one ray in thousands: no light to tell a layer's colour from

// What the 3x3 pixels around hold: a pixel whose few rays all missed a layer still learns its CoC and colour.
struct Around {
    float near_coc, far_coc;  // px
    vec4 far;                 // premultiplied
};

// Sums over the kernel.
struct Gather {
    vec4 near, far;
    float near_weight, far_weight;  // of the rays behind them
    float rays, pixels, freedom;    // what the statistics rest on; freedom: rays less one a pixel
    vec3 mean, square, within;      // compressed luminance of the near and the far part; hit ratio
};

// Variance per ray of the near and of the far part's light, and of the hit ratio.
vec3 variance_of(vec4 moments, float ratio) {
    return max(vec3(moments.yw - moments.xz * moments.xz, ratio * (1.0 - ratio)), 0.0);
}

float rays_of(vec4 state) {
    return min(state.x, state.y);
}

Around look_around(ivec2 p, ivec2 last) {
    vec2 coc = vec2(0.0), hits = vec2(1e-12);
    vec4 far = vec4(0.0);
    for (int i = 0; i < 9; i++) {
        ivec2 texel = clamp(p + ivec2(i % 3, i / 3) - 1, ivec2(0), last);
        vec4 state = texelFetch(in_layer_state, texel, 0);
        vec2 share = rays_of(state) * vec2(state.z, 1.0 - state.z);
        coc += share * texelFetch(in_layer_coc, texel, 0).xy;
        hits += share;
        far += texelFetch(in_far_light, texel, 0);
    }
    coc /= hits;
    return Around(coc.x, coc.y, far);
}

void gather_tap(inout Gather sum, ivec2 texel, float distance, vec2 radius) {
    vec4 state = texelFetch(in_layer_state, texel, 0);
    float rays = rays_of(state);
    if (rays == 0.0) return;
    vec2 circle = texelFetch(in_layer_coc, texel, 0).xy;
    vec4 moments = texelFetch(in_layer_moments, texel, 0);
    // A pixel without near hits has no near CoC; that it has none counts all the same.
    float near = distance <= radius.x ? (state.z > 0.0 ? reach_weight(circle.x, distance) : 1.0) : 0.0;
    float far = distance <= radius.y ? reach_weight(circle.y, distance) : 0.0;
    if (distance == 0.0) near = far = 1.0;
    sum.near += near * rays * texelFetch(in_near_light, texel, 0);
    sum.near_weight += near * rays;
    sum.far += far * rays * texelFetch(in_far_light, texel, 0);
    sum.far_weight += far * rays;
    float weight = max(near, far);
    sum.pixels += weight;
    sum.rays += weight * rays;
    sum.freedom += weight * (rays - 1.0);
    vec3 value = vec3(moments.xz, state.z);
    sum.mean += weight * rays * value;
    sum.square += weight * rays * value * value;
    sum.within += weight * rays * variance_of(moments, state.z);
}

Gather gather(ivec2 p, ivec2 last, vec2 radius) {
    Gather sum = Gather(vec4(0.0), vec4(0.0), 0.0, 0.0, 0.0, 0.0, 0.0, vec3(0.0), vec3(0.0), vec3(0.0));
    float reach = max(radius.x, radius.y);
    int rings = ring_count(reach, RINGS), taps = kernel_taps(rings);
    for (int i = 0; i < taps; i++) {
        vec2 tap = kernel_tap(i, rings, frame.frame_index, BLADES, frame.lens_rotation, frame.lens_anamorphic);
        ivec2 offset = ivec2(round(reach * tap));
        gather_tap(sum, clamp(p + offset, ivec2(0), last), 2.0 * length(vec2(offset)), 2.0 * radius);
    }
    return sum;
}

// How much of the near and of the far layer to take from the neighbours of a pixel whose `rays` rays vary by `variance`.
// Each layer counts with its own light and with the share that it leaves the other, so that an edge in one does not
// keep the other from being smoothed.
vec2 smoothing(Gather sum, float rays, vec3 variance) {
    vec3 pooled = sum.within / max(sum.freedom, 1.0), mean = sum.mean / sum.rays, noise, signal;
    for (int i = 0; i < 3; i++) {
        float spread = sum.square[i] / sum.rays - mean[i] * mean[i];
        noise[i] = ray_variance(variance[i], rays, pooled[i]) / rays;
        signal[i] = signal_variance(spread, pooled[i] * sum.pixels / sum.rays);
    }
    float light = (mean.x + mean.y) * (mean.x + mean.y);
    return vec2(neighbour_share(noise.x + light * noise.z, signal.x + light * signal.z),
                neighbour_share(noise.y + light * noise.z, signal.y + light * signal.z));
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(out_near_smooth)))) return;
    vec4 near = texelFetch(in_near_light, p, 0), far = texelFetch(in_far_light, p, 0);
    vec4 state = texelFetch(in_layer_state, p, 0);
    if (SPATIAL == 1 && state.w > 0.0) {
        ivec2 last = textureSize(in_layer_state, 0) - 1;
        vec2 circle = texelFetch(in_layer_coc, p, 0).xy;
        Around around = Around(circle.x, circle.y, far);
        if (min(near.a, far.a) == 0.0) around = look_around(p, last);
        float near_coc = state.z > 0.0 ? circle.x : around.near_coc, far_coc = state.z < 1.0 ? circle.y : around.far_coc;
        vec2 radius = vec2(gather_radius_half(near_coc, frame.reconstruct_radius),
                           gather_radius_half(far_coc, frame.reconstruct_radius));
        Gather sum = gather(p, last, radius);
        vec2 share = smoothing(sum, rays_of(state), variance_of(texelFetch(in_layer_moments, p, 0), state.z));
        near = mix(near, sum.near / sum.near_weight, share.x);
        far = mix(far, sum.far / sum.far_weight, share.y);
        // The layers cover the pixel together: the far one fills what the near one leaves open.
        if (far.a < FEWEST_SHARE) far = around.far;
        if (far.a < FEWEST_SHARE) near /= max(near.a, FEWEST_SHARE);
        far = far.a < FEWEST_SHARE ? vec4(0.0) : vec4(far.rgb / far.a, 1.0) * (1.0 - near.a);
    }
    imageStore(out_near_smooth, p, near);
    imageStore(out_far_smooth, p, far);
}
