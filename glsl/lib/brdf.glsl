// The surface and light model: GGX microfacets over a diffuse base, and integrals over a two-colour sky. Float64 twins:
// tests/gpu/shading_twin.py. Cosines are clamped to 0..1 by the caller; n_v is at least MIN_COSINE.
// Method: GGX (Walter et al. 2007), height-correlated Smith (Heitz 2014, section 6), Fresnel after Schlick 1994, as
//         glTF 2.0 appendix B.
#include "lib/pi.glsl"

const float MIN_COSINE = 1e-4;     // grazing: below it the visibility term divides by almost nothing
const float MIN_ROUGHNESS = 0.1;   // r: the peak 1/(4 pi r^4) stays within float16 under 80 lux

// Density of microfacet normals along h. |n x h|^2 replaces 1 - (n.h)^2, which cancels at the peak.
float ggx_distribution(vec3 n, vec3 h, float alpha) {
    vec3 c = cross(n, h);
    float a = dot(n, h) * alpha;
    float k = alpha / (dot(c, c) + a * a);
    return k * k / PI;
}

// Masking and shadowing over 4 n.l n.v.
float smith_visibility(float n_l, float n_v, float alpha) {
    float a2 = alpha * alpha;
    float view = n_l * sqrt(n_v * n_v * (1.0 - a2) + a2);
    float light = n_v * sqrt(n_l * n_l * (1.0 - a2) + a2);
    return 0.5 / max(view + light, 1e-7);
}

vec3 schlick_fresnel(vec3 f0, float v_h) {
    float x = clamp(1.0 - v_h, 0.0, 1.0);
    float x2 = x * x;
    return f0 + (1.0 - f0) * (x2 * x2 * x);
}

// Polynomials in e^(-4 n_v) (rows) and roughness (columns), fitted by us to numerical integrals of the model above
// over n_v 0.02..1 and roughness 0.1..1; tests/gpu/test_brdf.py integrates again and holds the fit to its error.
const mat4 ALBEDO_TOTAL = mat4(
    0.84878, 1.11336, -1.02304, -0.13455,
    1.49104, -8.99542, 5.31922, 2.96998,
    -3.42838, 13.59341, 0.78847, -12.17671,
    1.37276, -4.19851, -7.34684, 10.85653);
const mat4 ALBEDO_OFFSET = mat4(
    0.06696, -0.59598, 3.97500, -2.31954,
    -0.68533, 7.07399, -18.47708, 8.45440,
    1.51928, -14.58927, 26.98361, -9.59665,
    -0.92215, 8.26576, -12.56986, 3.46232);
const mat4 LOBE_REFLECTED = mat4(
    0.91174, -0.04420, 0.46800, -0.26721,
    1.12234, 0.52477, -3.35910, 1.13808,
    -3.93943, -2.54743, 6.05878, -1.07681,
    1.90053, 2.12610, -3.19389, 0.18386);
const mat4 LOBE_NORMAL = mat4(
    0.09186, -0.20955, -0.69385, 0.61943,
    -0.97754, 0.57090, 7.83710, -4.95633,
    2.45845, 8.81691, -29.98516, 16.48384,
    -0.92753, -9.57795, 23.40911, -12.46020);

vec4 powers(float x) {
    return vec4(1.0, x, x * x, x * x * x);
}

// Share of uniform light that the microfacets reflect towards the viewer: f0 * x + y (the split sum of Karis 2013).
vec2 specular_albedo(float n_v, float roughness) {
    vec4 x = powers(exp(-4.0 * n_v)), r = powers(roughness);
    float total = clamp(dot(x, ALBEDO_TOTAL * r), 0.0, 1.0);  // fitted as such, since energy depends on it
    float offset = clamp(dot(x, ALBEDO_OFFSET * r), 0.0, total);
    return vec2(total - offset, offset);
}

// Factor on the microfacets' reflection that returns what single scattering loses between them: all of it for f0 = 1
// (Turquin 2019, "Practical multiple scattering compensation for microfacet models", equation 16). `albedo`: from
// specular_albedo.
vec3 multiple_scattering(vec3 f0, vec2 albedo) {
    return 1.0 + f0 * (1.0 / clamp(albedo.x + albedo.y, 0.1, 1.0) - 1.0);
}

// Mean direction of that reflected light, length at most 1: x along the mirror direction, y along the normal.
vec2 specular_lobe(float n_v, float roughness) {
    vec4 x = powers(exp(-4.0 * n_v)), r = powers(roughness);
    return vec2(dot(x, LOBE_REFLECTED * r), dot(x, LOBE_NORMAL * r));
}

// Radiance of the two-colour sky along a direction whose height is y: linear in y, so that its integral over any lobe
// is its value at the lobe's mean direction.
vec3 hemisphere_radiance(vec3 sky, vec3 ground, float y) {
    return mix(ground, sky, 0.5 + 0.5 * y);
}

// Its cosine-weighted mean around a normal of height y: the mean direction of a cosine lobe is 2/3 of the normal.
vec3 hemisphere_diffuse(vec3 sky, vec3 ground, float y) {
    return hemisphere_radiance(sky, ground, (2.0 / 3.0) * y);
}

// Inverse-square falloff that reaches zero at the light's range (KHR_lights_punctual), 1/m^2.
float distance_attenuation(float distance_m, float inverse_range) {
    float x = distance_m * inverse_range;
    float x2 = x * x;
    return clamp(1.0 - x2 * x2, 0.0, 1.0) / max(distance_m * distance_m, 1e-8);  // 0.1 mm: finite at the light
}

// Cone falloff of a spot light from the cosine to its axis (KHR_lights_punctual).
float spot_attenuation(float cosine, float scale, float offset) {
    float x = clamp(cosine * scale + offset, 0.0, 1.0);
    return x * x;
}
