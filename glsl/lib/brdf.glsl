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
    0.78964, 1.29806, -4.03872, 1.63914,
    2.08193, -10.89954, 11.33665, 1.82027,
    -4.75762, 17.69383, -0.32412, -18.16122,
    2.19166, -6.74003, -9.12154, 16.19218);
const mat4 ALBEDO_OFFSET = mat4(
    0.06595, -0.58179, 3.93944, -2.29491,
    -0.67865, 6.96958, -18.20799, 8.26291,
    1.50712, -14.39253, 26.47310, -9.22910,
    -0.91561, 8.15970, -12.29538, 3.26399);
const mat4 LOBE_REFLECTED = mat4(
    0.90797, 0.04619, 0.23086, -0.12262,
    1.14713, -0.14852, -1.52370, 0.22726,
    -3.98705, -1.15760, 1.88287, 1.20340,
    1.92665, 1.32076, -0.61029, -1.33187);
const mat4 LOBE_NORMAL = mat4(
    0.09329, -0.23850, -0.61116, 0.53143,
    -0.98307, 0.71026, 7.47808, -4.52250,
    2.46107, 8.70542, -29.90347, 16.22457,
    -0.92582, -9.57627, 23.60136, -12.54483);

vec4 powers(float x) {
    return vec4(1.0, x, x * x, x * x * x);
}

// Share of uniform light that the microfacets reflect towards the viewer: f0 * x + y (the split sum of Karis 2013).
vec2 specular_albedo(float n_v, float roughness) {
    vec4 x = powers(exp(-4.0 * n_v)), r = powers(roughness);
    return clamp(vec2(dot(x, ALBEDO_SCALE * r), dot(x, ALBEDO_OFFSET * r)), 0.0, 1.0);
}

// Factor on the microfacets' reflection that returns what single scattering loses between them: all of it for f0 = 1
// (Turquin 2019, "Practical multiple scattering compensation for microfacet models", equation 16). `albedo`: from specular_albedo.
vec3 multiple_scattering(vec3 f0, vec2 albedo) {
    return 1.0 + f0 * (1.0 / clamp(albedo.x + albedo.y, 0.1, 1.0) - 1.0);
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
