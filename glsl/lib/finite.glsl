// What is not a number stays out of sums. Decided on the bits: compilers turn comparisons round as if there were no
// NaN. Float64 twins: tests/gpu/library_twin.py.

const float LARGEST_RADIANCE = 6e4;  // just inside float16, which most radiance targets hold

// Finite components as they are, 0 for the others.
vec4 finite(vec4 v) {
    return mix(vec4(0.0), v, lessThan(floatBitsToUint(v) & 0x7fffffffu, uvec4(0x7f800000u)));
}

// Radiance that filters may meet: NaN and negative become 0, infinite becomes the largest that float16 targets carry.
// The bits of the positive numbers and of infinity are 1 to 0x7f800000.
vec4 finite_radiance(vec4 c) {
    bvec4 positive = lessThan(floatBitsToUint(c) - 1u, uvec4(0x7f800000u));
    return mix(vec4(0.0), min(c, vec4(LARGEST_RADIANCE)), positive);
}

// Finite light as a float16 target can hold it: a difference of frames may be negative and overshoot.
vec4 within_half(vec4 light) {
    return clamp(light, -LARGEST_RADIANCE, LARGEST_RADIANCE);
}

// Which components an average can take in.
bvec3 usable(vec3 c) {
    const uint LIMIT = 0x7149f2cau;  // 1e30, far above any radiance
    return lessThan(floatBitsToUint(c) & 0x7fffffffu, uvec3(LIMIT));
}

bool is_usable(vec3 c) {
    return all(usable(c));
}
