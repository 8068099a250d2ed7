// The picture beyond its rim, for the mask's kernels: it goes on as steeply as it came (mirrored in the rim's value), so
// that a slanted plane ends without an edge, smoothed or not.

vec4 within_or_beyond(sampler2D guide, ivec2 p) {
    ivec2 last = textureSize(guide, 0) - 1, rim = clamp(p, ivec2(0), last);
    vec4 value = texelFetch(guide, rim, 0);
    if (p == rim) return value;
    ivec2 mirror = clamp(2 * rim - p, ivec2(0), last);
    vec4 beside = 2.0 * value - texelFetch(guide, ivec2(mirror.x, rim.y), 0);
    vec4 mirrored = 2.0 * texelFetch(guide, ivec2(rim.x, mirror.y), 0) - texelFetch(guide, mirror, 0);
    return 2.0 * beside - mirrored;  // along x, then along y
}
