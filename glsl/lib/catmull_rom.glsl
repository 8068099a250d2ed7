// Resampling with the interpolating cubic of Catmull and Rom 1974, which keeps values, slopes and means where a linear
// one blurs; and clipping of history. Float64 twins: tests/gpu/shading_twin.py, tests/gpu/hybrid_twin.py.

// Weight of a sample `x` sample distances away; 0 from 2 on.
float catmull_rom(float x) {
    x = min(abs(x), 2.0);
    return x < 1.0 ? 1.0 + x * x * (1.5 * x - 2.5) : 2.0 + x * (-4.0 + x * (2.5 - 0.5 * x));
}

// Catmull-Rom weights of the four texels around fraction f, the middle two merged into one bilinear fetch at offset12
// from the base texel.
void catmull_rom_weights(vec2 f, out vec2 w0, out vec2 w12, out vec2 w3, out vec2 offset12) {
    w0 = f * (-0.5 + f * (1.0 - 0.5 * f));
    vec2 w1 = 1.0 + f * f * (-2.5 + 1.5 * f);
    vec2 w2 = f * (0.5 + f * (2.0 - 1.5 * f));
    w3 = f * f * (-0.5 + 0.5 * f);
    w12 = w1 + w2;
    offset12 = w2 / w12;
}

// `point` if it lies within `reach` of `centre` on every axis, else where the segment to the centre enters that box.
vec3 clip_to_box(vec3 point, vec3 centre, vec3 reach) {
    vec3 away = point - centre;
    vec3 ratio = abs(away) / max(reach, vec3(1e-6));
    float beyond = max(ratio.x, max(ratio.y, ratio.z));
    return beyond > 1.0 ? centre + away / beyond : point;
}
