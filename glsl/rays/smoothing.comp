// Says how much of each traced layer is noise, and so how much of it its neighbours may smooth away.
// Reads: layer_state (x, y: rays; z: hit ratio; w: 0 where nothing is held), layer_coc (px; near, far), layer_moments
//   (compressed luminance and its square, of the near and the far part), half resolution.
// Writes: layer_smoothing (x: of the near, y: of the far layer, 0..1; zw: how far either is gathered, half-res px),
//   half resolution.
// Over: the tiles with rays of RayTiles; elsewhere what it writes is 0.
// Method: poster, 2.2, "weighted based on clamped variance estimates", as a local Wiener filter (Lee 1980): the
// accumulated variance, pooled over the kernel, is what the neighbours' means differ by without differing in truth.
#include "rays/neighbours.glsl"
#include "dof/ray_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_layer_moments;
layout(rgba16f) uniform writeonly image2D out_layer_smoothing;

// Sums over the kernel.
struct Statistics {
    float rays, pixels, freedom;  // what they rest on; freedom: rays less one a pixel
    vec3 mean, square, within;    // compressed luminance of the near and the far part; hit ratio
};

// Variance per ray of the near and of the far part's light, and of the hit ratio.
vec3 variance_of(vec4 moments, float ratio) {
    return max(vec3(moments.yw - moments.xz * moments.xz, ratio * (1.0 - ratio)), 0.0);
}

Statistics gather(ivec2 p, vec2 radius) {
    Statistics sum = Statistics(0.0, 0.0, 0.0, vec3(0.0), vec3(0.0), vec3(0.0));
    ivec2 last = textureSize(in_layer_state, 0) - 1;
    float reach = max(radius.x, radius.y);
    int rings = ring_count(reach, RINGS), taps = kernel_taps(rings);
    for (int i = 0; i < taps; i++) {
        ivec2 offset = tap_offset(i, rings, reach), texel = clamp(p + offset, ivec2(0), last);
        vec4 state = fetch_finite(in_layer_state, texel), moments = fetch_light(in_layer_moments, texel);
        float rays = rays_of(state);
        if (rays == 0.0) continue;
        vec2 weights = tap_weight(state, fetch_finite(in_layer_coc, texel).xy, 2.0 * length(vec2(offset)), radius);
        float weight = max(weights.x, weights.y);
        vec3 value = vec3(moments.xz, state.z);
        sum.pixels += weight;
        sum.rays += weight * rays;
        sum.freedom += weight * (rays - 1.0);
        sum.mean += weight * rays * value;
        sum.square += weight * rays * value * value;
        sum.within += weight * rays * variance_of(moments, state.z);
    }
    return sum;
}

// Each layer counts with its own light and with the share that it leaves the other, so that an edge in one does not
// keep the other from being smoothed.
vec2 smoothing(Statistics sum, float rays, vec3 variance) {
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
    ivec2 tile = listed_tile(), p = texel_of(tile, 8);
    if (tile.x < 0 || any(greaterThanEqual(p, imageSize(out_layer_smoothing)))) return;
    vec4 state = fetch_finite(in_layer_state, p);
    vec2 share = vec2(0.0), radius = vec2(0.0);
    if (state.w > 0.0) {
        radius = layer_radius(layer_coc(p));
        Statistics sum = gather(p, radius);
        share = smoothing(sum, rays_of(state), variance_of(fetch_light(in_layer_moments, p), state.z));
    }
    imageStore(out_layer_smoothing, p, vec4(share, radius));
}
