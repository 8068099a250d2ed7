// Colour maps of the target viewer: sequential, diverging, signed and directional values as display RGB. Float64 twin:
// app/panel/colormap.py.
// Method: cubehelix (Green 2011, "A colour scheme for the display of astronomical intensity images", section 2):
// lightness rises evenly, so that the order of values can be read even in grey. The diverging map is our own, even in
// lightness to both sides of zero.
#include "lib/pi.glsl"

const vec3 INVALID = vec3(1.0, 0.0, 1.0);  // what is not a number or infinite: magenta, which no map holds

vec3 sequential(float t) {
    t = clamp(t, 0.0, 1.0);
    float angle = 2.0 * PI * (0.5 / 3.0 + 1.0 - 1.0 * t);  // start 0.5, -1 rotation: blue, green, ochre, pink
    float amplitude = 1.1 * t * (1.0 - t) / 2.0;  // hue 1.1: as saturated as the colour cube allows, nearly
    float c = cos(angle), s = sin(angle);
    return clamp(t + amplitude * vec3(-0.14861 * c + 1.78277 * s, -0.29227 * c - 0.90649 * s, 1.97294 * c), 0.0, 1.0);
}

vec3 diverging(float s) {
    const vec3 stops[5] = vec3[](
        vec3(0.03, 0.16, 0.45), vec3(0.36, 0.63, 0.88), vec3(0.96, 0.96, 0.94), vec3(0.95, 0.56, 0.30),
        vec3(0.52, 0.05, 0.05));
    float x = (clamp(s, -1.0, 1.0) + 1.0) * 2.0;
    int left = min(int(x), 3);
    return mix(stops[left], stops[left + 1], x - float(left));
}

float signed_unit(float value, float low, float high) {
    return value < 0.0 ? -value / min(low, -1e-30) : value / max(high, 1e-30);
}

vec3 wheel(float x, float y) {
    float hue = (x == 0.0 && y == 0.0) ? 0.0 : atan(y, x) / (2.0 * PI);  // atan(0, 0) is undefined in GLSL
    vec3 spread = abs(fract(hue + vec3(0.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0;
    return clamp(spread, 0.0, 1.0) * min(length(vec2(x, y)), 1.0);
}
