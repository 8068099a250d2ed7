// Smooths the noise of few rays: each traced layer is gathered from neighbours whose blur reaches the pixel.
// Reads: near_light, far_light (premultiplied; a: share of light), layer_state (x, y: rays; z: hit ratio; w: 0 where
//   nothing is held), layer_coc (px; near, far), layer_smoothing (how much of each layer is noise, 0..1), half
//   resolution.
// Writes: near_smooth, far_smooth (as near_light and far_light), half resolution.
// Method: poster, 2.2: a circular gather scaled by CoC, here one radius a layer, so that what is in focus behind blur
// stays sharp. Samples whose CoC is smaller than their distance are rejected. Two pixels exchange as much as the less
// noisy one of them may give and take: light only moves, none is made or lost, and converged regions stay as they are.
// Rings lie at most two texels apart and turn each frame, so the finest level of detail serves. The kernel is the whole
// aperture's: where the barrel narrows the lens, a tap that lies outside still tells of the same layers' light.
#include "rays/neighbours.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_near_light;
uniform sampler2D in_far_light;
uniform sampler2D in_layer_smoothing;
layout(rgba16f) uniform writeonly image2D out_near_smooth;
layout(rgba16f) uniform writeonly image2D out_far_smooth;

const float FEWEST_SHARE = 1e-4;  // below any hit of one ray in thousands: no light to tell a layer's colour from

// Lets the layers of the pixel exchange light with its neighbours.
void exchange(ivec2 p, vec4 state, inout vec4 near, inout vec4 far) {
    vec2 coc = layer_coc(p), radius = layer_radius(coc), share = texelFetch(in_layer_smoothing, p, 0).xy;
    float reach = max(radius.x, radius.y);
    int rings = ring_count(reach, RINGS), taps = kernel_taps(rings);
    vec4 near_sum = vec4(0.0), far_sum = vec4(0.0);
    ivec2 last = textureSize(in_layer_state, 0) - 1;
    for (int i = 1; i < taps; i++) {
        ivec2 offset = tap_offset(i, rings, reach), texel = clamp(p + offset, ivec2(0), last);
        vec4 other = texelFetch(in_layer_state, texel, 0);
        if (other.w == 0.0) continue;
        float distance = 2.0 * length(vec2(offset));
        vec2 weight = tap_weight(other, texelFetch(in_layer_coc, texel, 0).xy, distance, radius);
        weight = min(weight, tap_weight(state, coc, distance, radius));
        weight *= min(share, texelFetch(in_layer_smoothing, texel, 0).xy);
        near_sum += weight.x * (texelFetch(in_near_light, texel, 0) - near);
        far_sum += weight.y * (texelFetch(in_far_light, texel, 0) - far);
    }
    near += near_sum / float(taps);
    far += far_sum / float(taps);
}

// The far light of the 3x3 pixels around, for a pixel whose few rays all missed it.
vec4 far_around(ivec2 p) {
    vec4 far = vec4(0.0);
    ivec2 last = textureSize(in_layer_state, 0) - 1;
    for (int i = 0; i < 9; i++) {
        far += texelFetch(in_far_light, clamp(p + ivec2(i % 3, i / 3) - 1, ivec2(0), last), 0);
    }
    return far;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(out_near_smooth)))) return;
    vec4 near = texelFetch(in_near_light, p, 0), far = texelFetch(in_far_light, p, 0);
    vec4 state = texelFetch(in_layer_state, p, 0);
    if (state.w > 0.0) {
        exchange(p, state, near, far);
        // The layers cover the pixel together: the far one fills what the near one leaves open.
        if (far.a < FEWEST_SHARE) far = far_around(p);
        if (far.a < FEWEST_SHARE) near /= max(near.a, FEWEST_SHARE);
        far = far.a < FEWEST_SHARE ? vec4(0.0) : vec4(far.rgb / far.a, 1.0) * (1.0 - near.a);
    }
    imageStore(out_near_smooth, p, near);
    imageStore(out_far_smooth, p, far);
}
