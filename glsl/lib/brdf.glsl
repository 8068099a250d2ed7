// The surface and light model: GGX microfacets over a diffuse base, and integrals over a two-colour sky. Float64 twins:
// tests/gpu/shading_twin.py. Cosines are clamped to 0..1 by the caller; n_v is at least MIN_COSINE.
// Method: GGX (Walter et al. 2007), height-correlated Smith (Heitz 2014, section 6), Fresnel after Schlick 1994, as glTF 2.0 appendix B.

const float BRDF_PI = 3.14159265358979;
const float MIN_COSINE = 1e-4;     // grazing: below it the visibility term divides by almost nothing
const float MIN_ROUGHNESS = 0.1;   // its peak 1/(pi a^2), a = r^2, times the visibility of 1/4 stays below float16's range under 80 lux

// Density of microfacet normals along h. |n x h|^2 replaces 1 - (n.h)^2, which cancels at the peak.
float ggx_distribution(vec3 n, vec3 h, float alpha) {
    vec3 c = cross(n, h);
    float a = dot(n, h) * alpha;
    float k = alpha / (dot(c, c) + a * a);
    return k * k / BRDF_PI;
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

// Polynomials in e^(-4 n_v) (rows) and roughness (columns), fitted by us to numerical integrals of the model above over n_v 0.02..1 and
// roughness 0.1..1; tests/gpu/test_brdf.py integrates again and holds the fit to its error.
const mat4 ALBEDO_SCALE = mat4(
    0.87254, 0.76485, -3.33063, 1.40321,
    1.33242, -7.90154, 10.74390, -0.45733,
    -3.16756, 12.88956, -4.43043, -9.14770,
    1.27460, -4.83719, -3.76964, 8.67687);
const mat4 ALBEDO_OFFSET = mat4(
    0.06862, -0.60365, 3.98343, -2.32083,
    -0.70344, 7.09652, -18.40371, 8.36204,
    1.56150, -14.63590, 26.82005, -9.40594,
    -0.94850, 8.30021, -12.49410, 3.37003);
const mat4 LOBE_REFLECTED = mat4(
    0.90835, 0.07925, 0.08436, -0.01325,
    1.13664, -0.30890, -0.49918, -0.54740,
    -3.94233, -1.15636, 0.49614, 2.40267,
    1.89029, 1.47315, -0.17168, -1.81439);
const mat4 LOBE_NORMAL = mat4(
    0.09245, -0.23581, -0.62858, 0.53961,
    -0.97671, 0.67261, 7.69756, -4.69314,
    2.45925, 8.68811, -30.18205, 16.54772,
    -0.92989, -9.51415, 23.64163, -12.67580);

vec4 powers(float x) {
    return vec4(1.0, x, x * x, x * x * x);
}

// Share of uniform light that the microfacets reflect towards the viewer: f0 * x + y (the split sum of Karis 2013).
vec2 specular_albedo(float n_v, float roughness) {
    vec4 x = powers(exp(-4.0 * n_v)), r = powers(roughness);
    return clamp(vec2(dot(x, ALBEDO_SCALE * r), dot(x, ALBEDO_OFFSET * r)), 0.0, 1.0);
}

// Mean direction of that reflected light, length at most 1: x along the mirror direction, y along the normal.
vec2 specular_lobe(float n_v, float roughness) {
    vec4 x = powers(exp(-4.0 * n_v)), r = powers(roughness);
    return vec2(dot(x, LOBE_REFLECTED * r), dot(x, LOBE_NORMAL * r));
}

// Radiance of the two-colour sky along a direction whose height is y: linear in y, so that its integral over any lobe is its value at the
// lobe's mean direction.
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
    return clamp(1.0 - x2 * x2, 0.0, 1.0) / max(distance_m * distance_m, 1e-8);  // 0.1 mm: a light in a surface stays finite
}

// Cone falloff of a spot light from the cosine to its axis (KHR_lights_punctual).
float spot_attenuation(float cosine, float scale, float offset) {
    float x = clamp(cosine * scale + offset, 0.0, 1.0);
    return x * x;
}
