// Tone curves and the sRGB transfer function. Float64 twins: app/tone.py.

// sRGB encoding of linear 0..1 (IEC 61966-2-1).
vec3 srgb_encode(vec3 linear) {
    vec3 curve = 1.055 * pow(max(linear, 1e-8), vec3(1.0 / 2.4)) - 0.055;
    return mix(curve, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}

const float LONG_WHITE = 1e6;  // far beyond where any curve ends in white, and its square far from overflow

// Filmic curve: a rational fit of the ACES reference rendering and sRGB output transforms (Narkowicz 2015), with its
// 0.6 exposure.
vec3 tone_aces(vec3 light) {
    vec3 x = 0.6 * min(light, LONG_WHITE);
    return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}

// Khronos PBR Neutral (2024): colours below 0.8 keep their values, brighter ones compress towards white at constant
// hue.
vec3 tone_neutral(vec3 light) {
    const float START = 0.8 - 0.04, DESATURATION = 0.15;
    float low = min(light.r, min(light.g, light.b));
    vec3 color = light - (low < 0.08 ? low - 6.25 * low * low : 0.04);
    float peak = max(color.r, max(color.g, color.b));
    if (peak < START) return color;
    float range = 1.0 - START;
    float compressed = 1.0 - range * range / (peak + range - START);
    color *= compressed / peak;
    return mix(color, vec3(compressed), 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0));
}
