// What a point of the scene is made of: the one reading of materials and textures that raster and rays share.
// Level of detail, one rule for both: footprint_uv = sqrt(uv area / world area of the triangle) * planar depth * 2
// tan(fov/2) / H, isotropic; times the texture's size it is the pixel in texels.
#include "shared/scene.glsl"
#include "lib/octahedral.glsl"

struct Surface {
    vec3 position;     // world, m
    vec3 normal;       // unit, on the viewer's side
    vec3 base_color;   // linear
    float metallic;
    float roughness;   // perceptual
    vec3 emissive;     // linear radiance
};

// Averaged alpha loses coverage level by level, and leaves thin out with distance: this much is given back per level
// (Golus 2017, "Anti-aliased alpha test", mip level alpha scale).
const float ALPHA_GAIN_PER_LEVEL = 0.25;

// Base colour; a: alpha to compare with the cut-off.
vec4 base_color_at(uint material, vec2 uv, float footprint_uv) {
    Material m = material_at(material);
    vec4 color = m.base_color;
#if TEXTURED
    uint slot = m.textures.x;
    if (slot != NO_TEXTURE) {
        Texel texel = texel_of(slot, m.uv_base_u, m.uv_base_v, uv, footprint_uv);
        color *= read_color(texel);
        color.a *= 1.0 + ALPHA_GAIN_PER_LEVEL * texel.lod;
    }
#endif
    return color;
}

// False where a masked material has a hole.
bool alpha_passes(uint material, vec2 uv, float footprint_uv) {
#if ALPHA_MASKED
    float cutoff = material_at(material).alpha_cutoff;
    return cutoff == 0.0 || base_color_at(material, uv, footprint_uv).a >= cutoff;
#else
    return true;
#endif
}

// The normal with its map applied; `side` is +1 seen from the side the normals point to, else -1.
vec3 normal_at(uint material, float side, vec3 normal, vec4 tangent, vec2 uv, float footprint_uv) {
    vec3 n = normalize(normal);
#if NORMAL_MAPPED
    Material m = material_at(material);
    uint slot = m.textures.z;
    if (slot != NO_TEXTURE) {
        vec4 row_u = m.uv_normal_u, row_v = m.uv_normal_v;
        Texel texel = texel_of(slot, row_u, row_v, uv, footprint_uv);
        vec3 bump = 2.0 * read_data(texel).xyz - 1.0;
        bump.xy *= m.normal_scale;
        vec3 t = tangent.xyz - n * dot(n, tangent.xyz);
        t *= inversesqrt(max(dot(t, t), 1e-12));
        n = normalize(t * bump.x + cross(n, t) * (tangent.w * bump.y) + n * max(bump.z, 1e-3));
    }
#endif
    return n * side;
}

vec3 emissive_at(uint material, vec2 uv, float footprint_uv) {
#if EMISSIVE
    Material m = material_at(material);
    vec3 radiance = m.emissive;
#if TEXTURED
    uint slot = m.textures.w;
    if (slot != NO_TEXTURE) {
        vec4 row_u = m.uv_emissive_u, row_v = m.uv_emissive_v;
        radiance *= read_color(texel_of(slot, row_u, row_v, uv, footprint_uv)).rgb;
    }
#endif
    return radiance;
#else
    return vec3(0.0);
#endif
}

// x: metallic, y: roughness.
vec2 metallic_roughness_at(uint material, vec2 uv, float footprint_uv) {
    Material m = material_at(material);
    vec2 value = vec2(m.metallic, m.roughness);
#if TEXTURED && LIT
    uint slot = m.textures.y;
    if (slot != NO_TEXTURE) {
        vec4 row_u = m.uv_surface_u, row_v = m.uv_surface_v;
        value *= read_data(texel_of(slot, row_u, row_v, uv, footprint_uv)).bg;
    }
#endif
    return value;
}

// The surface whose base colour is already known (the alpha test reads it first).
Surface surface_of(
    vec3 base_color, uint material, vec3 position, float side, vec3 normal, vec4 tangent, vec2 uv, float footprint_uv) {
    vec2 metallic_roughness = metallic_roughness_at(material, uv, footprint_uv);
    return Surface(
        position, normal_at(material, side, normal, tangent, uv, footprint_uv), base_color,
        metallic_roughness.x, metallic_roughness.y, emissive_at(material, uv, footprint_uv));
}

Surface surface_at(uint material, vec3 position, float side, vec3 normal, vec4 tangent, vec2 uv, float footprint_uv) {
    vec3 base_color = base_color_at(material, uv, footprint_uv).rgb;
    return surface_of(base_color, material, position, side, normal, tangent, uv, footprint_uv);
}
