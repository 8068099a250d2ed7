// Unit vectors in two numbers: the octahedral map (Meyer et al. 2010; Cigolle et al. 2014, "A survey of efficient
// representations for independent unit vectors", JCGT 3:2). Float64 twin: app/gpu/octahedral.py.

vec2 sign_not_zero(vec2 v) {
    return vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

// Unit vector to the square -1..1.
vec2 octahedral_encode(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return n.z < 0.0 ? (1.0 - abs(p.yx)) * sign_not_zero(p) : p;
}

// Square -1..1 to unit vector.
vec3 octahedral_decode(vec2 p) {
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float fold = max(-n.z, 0.0);  // how far below the horizon: folded back over the diagonal, without a branch
    n.xy -= sign_not_zero(p) * fold;
    return normalize(n);
}

// The vertex's packed normal.
vec3 unpack_normal(uint bits) {
    return octahedral_decode(unpackSnorm2x16(bits));
}

// The vertex's packed tangent: direction, and the handedness that the lowest bit of the high half carries.
vec4 unpack_tangent(uint bits) {
    float handedness = (bits & 0x10000u) != 0u ? -1.0 : 1.0;
    return vec4(octahedral_decode(unpackSnorm2x16(bits & ~0x10000u)), handedness);
}
