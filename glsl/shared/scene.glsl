// The scene as every shader sees it: vertices, materials, lights and textures (app/gpu/scene.py).
#include "shared/records.glsl"

RECORDS(Vertices, Vertex, vertices, vertex_at)
RECORDS(Materials, Material, materials, material_at)
RECORDS(Lights, Light, lights, light_at)

const uint NO_TEXTURE = 0xffffffffu;

#if TEXTURED
// Arrays by size class (app/gpu/textures.py: CLASS_SIZES), each compiled in only if the scene has such an image.
#if COLOR_CLASSES & 1
uniform sampler2DArray scene_color_0;
#endif
#if COLOR_CLASSES & 2
uniform sampler2DArray scene_color_1;
#endif
#if COLOR_CLASSES & 4
uniform sampler2DArray scene_color_2;
#endif
#if DATA_CLASSES & 1
uniform sampler2DArray scene_data_0;
#endif
#if DATA_CLASSES & 2
uniform sampler2DArray scene_data_1;
#endif
#if DATA_CLASSES & 4
uniform sampler2DArray scene_data_2;
#endif

// Where to read a slot: uv wrapped into 0..1, the layer, and the explicit level of detail, so that uv seams need no
// derivatives.
struct Texel {
    vec3 at;
    float lod;
    uint size_class;
};

// Sampler state is `repeat`; the other modes are computed. Their coordinate stays half a texel of the coarser mip
// level inside, or the filter would reach round to the far edge.
float wrap_coordinate(float x, uint mode, float half_texel) {
    if (mode == 0u) return x;
    float mirrored = 1.0 - abs(2.0 * fract(0.5 * x) - 1.0);
    return clamp(mode == 1u ? mirrored : x, half_texel, 1.0 - half_texel);
}

Texel texel_of(uint slot, vec4 row_u, vec4 row_v, vec2 uv, float footprint_uv) {
    Texel texel;
    texel.size_class = slot >> 24;
    float size = float(texel.size_class == 0u ? CLASS_SIZE_0 : texel.size_class == 1u ? CLASS_SIZE_1 : CLASS_SIZE_2);
    float scale = sqrt(abs(row_u.x * row_v.y - row_u.y * row_v.x));
    texel.lod = max(log2(max(footprint_uv * scale * size, 1e-6)), 0.0);
    float half_texel = min(0.5 * exp2(ceil(texel.lod)) / size, 0.5);
    vec2 p = vec2(dot(row_u.xyz, vec3(uv, 1.0)), dot(row_v.xyz, vec3(uv, 1.0)));
    p.x = wrap_coordinate(p.x, (slot >> 16) & 3u, half_texel);
    p.y = wrap_coordinate(p.y, (slot >> 18) & 3u, half_texel);
    texel.at = vec3(p, float(slot & 0xffffu));
    return texel;
}

// Linear colour and alpha.
vec4 read_color(Texel texel) {
    vec4 color = vec4(1.0);
#if COLOR_CLASSES & 1
    if (texel.size_class == 0u) color = textureLod(scene_color_0, texel.at, texel.lod);
#endif
#if COLOR_CLASSES & 2
    if (texel.size_class == 1u) color = textureLod(scene_color_1, texel.at, texel.lod);
#endif
#if COLOR_CLASSES & 4
    if (texel.size_class == 2u) color = textureLod(scene_color_2, texel.at, texel.lod);
#endif
    return color;
}

// Normals and metallic-roughness as stored, 0..1.
vec4 read_data(Texel texel) {
    vec4 data = vec4(1.0);
#if DATA_CLASSES & 1
    if (texel.size_class == 0u) data = textureLod(scene_data_0, texel.at, texel.lod);
#endif
#if DATA_CLASSES & 2
    if (texel.size_class == 1u) data = textureLod(scene_data_1, texel.at, texel.lod);
#endif
#if DATA_CLASSES & 4
    if (texel.size_class == 2u) data = textureLod(scene_data_2, texel.at, texel.lod);
#endif
    return data;
}
#endif
