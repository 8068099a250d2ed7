// What a surface sends towards the viewer: the one lighting model of raster image and ray hits.
// Method: glTF metallic-roughness (glTF 2.0 appendix B), with light that bounces among microfacets kept and the diffuse
// base scaled by what they let through, so that no surface returns more than it receives and a white one returns all;
// suns, point and spot lights; a two-colour sky in closed form; shadow map with a 3x3 texel tent of four
// hardware-filtered taps (after Reeves, Salesin and Cook 1987) and an offset along the normal (Holbert 2011).
#include "shared/frame.glsl"
#include "shared/surface.glsl"
#include "lib/brdf.glsl"
#include "lib/color.glsl"
#include "lib/finite.glsl"

const float DIELECTRIC_F0 = 0.04;   // index of refraction 1.5, glTF's default

// What the viewer sees where nothing is.
vec3 sky_radiance(vec3 direction) {
#if LIT
    return hemisphere_radiance(frame.sky, frame.ground, direction.y);
#else
    return frame.sky;
#endif
}

#if LIT
struct Reflection {
    vec3 diffuse;
    vec3 specular;
};

// What the microfacet model needs at one point, found once for all lights.
struct Shading {
    vec3 normal;
    vec3 view;
    float n_v;
    float roughness;
    float alpha;
    vec3 f0;
    vec3 specular_gain;  // what light bouncing among the microfacets adds
    vec3 diffuse;        // albedo of the base under the microfacets
};

Shading prepare_shading(Surface s, vec3 view_dir) {
    Shading p;
    p.normal = s.normal;
    p.view = view_dir;
    p.n_v = clamp(dot(s.normal, view_dir), MIN_COSINE, 1.0);
    p.roughness = clamp(s.roughness, MIN_ROUGHNESS, 1.0);
    p.alpha = p.roughness * p.roughness;
    p.f0 = mix(vec3(DIELECTRIC_F0), s.base_color, s.metallic);
    vec2 albedo = specular_albedo(p.n_v, p.roughness);
    p.specular_gain = multiple_scattering(p.f0, albedo);
    float through = 1.0 - (DIELECTRIC_F0 * albedo.x + albedo.y) * multiple_scattering(vec3(DIELECTRIC_F0), albedo).x;
    p.diffuse = s.base_color * (1.0 - s.metallic) * clamp(through, 0.0, 1.0);
    return p;
}

// Light of irradiance 1 from direction `light_dir` (unit, towards the light) on a facing surface.
Reflection reflect_light(Shading p, vec3 light_dir) {
    float n_l = clamp(dot(p.normal, light_dir), 0.0, 1.0);
    vec3 h = normalize(light_dir + p.view);
    vec3 fresnel = schlick_fresnel(p.f0, dot(p.view, h));
    float microfacets = ggx_distribution(p.normal, h, p.alpha) * smith_visibility(n_l, p.n_v, p.alpha);
    return Reflection(p.diffuse * (n_l / PI), fresnel * p.specular_gain * (microfacets * n_l));
}

Reflection reflect_sky(Shading p) {
    vec2 albedo = specular_albedo(p.n_v, p.roughness);
    vec2 lobe = specular_lobe(p.n_v, p.roughness);
    float height = lobe.x * reflect(-p.view, p.normal).y + lobe.y * p.normal.y;
    vec3 around = hemisphere_radiance(frame.sky, frame.ground, clamp(height, -1.0, 1.0));
    return Reflection(
        p.diffuse * hemisphere_diffuse(frame.sky, frame.ground, p.normal.y),
        min((p.f0 * albedo.x + albedo.y) * p.specular_gain, vec3(1.0)) * around);
}

#if SHADOWS
uniform sampler2DShadow scene_shadow;

// Offset along the normal, in texels of the shadow map: what the 3x3 tent reaches on a surface at 45 degrees (1.5
// texels diagonally).
const float NORMAL_OFFSET_TEXELS = 2.2;
const float DEPTH_BIAS_TEXELS = 0.5;  // towards the sun, for surfaces that face it, where the offset above vanishes

// Share of the sun's light that reaches a point, 0..1; outside the map nothing is in shadow.
float sun_visibility(vec3 position, vec3 normal, vec3 light_dir) {
    float size = float(textureSize(scene_shadow, 0).x);
    vec3 row_x = vec3(frame.shadow_view_proj[0].x, frame.shadow_view_proj[1].x, frame.shadow_view_proj[2].x);
    float texel_m = 2.0 / (size * length(row_x));
    float n_l = clamp(dot(normal, light_dir), 0.0, 1.0);
    vec3 lift = normal * (NORMAL_OFFSET_TEXELS * sqrt(1.0 - n_l * n_l)) + light_dir * DEPTH_BIAS_TEXELS;
    vec3 at = (frame.shadow_view_proj * vec4(position + texel_m * lift, 1.0)).xyz * 0.5 + 0.5;
    float h = 0.5 / size;
    return 0.25 * (textureLod(scene_shadow, at + vec3(-h, -h, 0.0), 0.0)
                 + textureLod(scene_shadow, at + vec3(h, -h, 0.0), 0.0)
                 + textureLod(scene_shadow, at + vec3(-h, h, 0.0), 0.0)
                 + textureLod(scene_shadow, at + vec3(h, h, 0.0), 0.0));
}
#endif

// Direction towards a light (unit) and the irradiance it gives a surface that faces it.
vec3 irradiance_from(Light light, Shading p, vec3 position, out vec3 light_dir) {
    light_dir = -light.direction;
    float strength = 1.0;
#if POINT_LIGHTS
    if (light.kind != 0u) {
        vec3 away = light.position - position;
        float distance_m = max(length(away), 1e-6);
        light_dir = away / distance_m;
        strength = distance_attenuation(distance_m, light.inverse_range);
        float cosine = dot(-light_dir, light.direction);
        if (light.kind == 2u) strength *= spot_attenuation(cosine, light.spot_scale, light.spot_offset);
    }
#endif
#if SHADOWS
    if (light.casts_shadow != 0u) strength *= sun_visibility(position, p.normal, light_dir);
#endif
    return light.intensity * strength;
}
#endif

// Radiance towards the viewer (`view_dir`: unit, from the surface to the viewer); a: luminance of the specular part.
// Unlit: the base colour and what the surface emits.
vec4 shade(Surface s, vec3 view_dir) {
#if LIT
    Shading p = prepare_shading(s, view_dir);
    Reflection sum = reflect_sky(p);
#if POINT_LIGHTS || SUN
    for (uint i = 0u; i < frame.light_count; ++i) {
        vec3 light_dir;
        vec3 irradiance = irradiance_from(light_at(i), p, s.position, light_dir);
        Reflection r = reflect_light(p, light_dir);
        sum.diffuse += irradiance * r.diffuse;
        sum.specular += irradiance * r.specular;
    }
#endif
    vec3 specular = min(sum.specular, LARGEST_RADIANCE);
    return vec4(min(sum.diffuse + specular + s.emissive, LARGEST_RADIANCE), luminance(specular));
#else
    return vec4(min(s.base_color + s.emissive, LARGEST_RADIANCE), 0.0);
#endif
}
