// The picture beyond its rim, for the mask's kernels: it goes on as steeply as it came (mirrored in the rim's value),
// so that a slanted plane ends without an edge, smoothed or not.
#include "shared/fetch.glsl"

vec4 within_or_beyond(sampler2D guide, ivec2 p) {
    ivec2 last = textureSize(guide, 0) - 1, rim = clamp(p, ivec2(0), last);
    vec4 value = fetch_finite(guide, rim);
    if (p == rim) return value;
    ivec2 mirror = clamp(2 * rim - p, ivec2(0), last);
    vec4 beside = 2.0 * value - fetch_finite(guide, ivec2(mirror.x, rim.y));
    vec4 mirrored = 2.0 * fetch_finite(guide, ivec2(rim.x, mirror.y)) - fetch_finite(guide, mirror);
    return 2.0 * beside - mirrored;  // along x, then along y
}
