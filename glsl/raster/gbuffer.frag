// Writes what the nearest surface in each pixel is made of.
// Reads: materials and textures of the scene.
// Writes (full resolution): base_color (linear rgb, metallic), normal (octahedral xy, roughness, 1), depth (planar, m),
//   emissive (linear radiance) and object (index of the moving object, 0: none) where the scene has any.
// Method: deferred shading (Saito and Takahashi 1990); texture detail from the ratio of a triangle's area in uv and in
// space, taken here from screen derivatives: both are planar over the triangle, so the ratio is the constant that a ray
// computes from the vertices. In a scene too large for steps that are even in 1 / depth, the depth test compares
// logarithms (Kemen 2009, "Logarithmic Depth Buffer"): steps of 1.5e-6 of the distance, however far.
#include "shared/primary.glsl"
#include "shared/surface.glsl"
#include "lib/coc.glsl"
#include "lib/color.glsl"

in vec3 v_normal;
flat in uint v_material;
#if HAS_OBJECT
flat in uint v_object;
#endif
#if TEXTURED
in vec2 v_uv;
#endif
#if NORMAL_MAPPED
in vec4 v_tangent;
#endif

out vec4 out_base_color;
out vec4 out_normal;
out float out_depth;
#if HAS_EMISSIVE
out vec4 out_emissive;
#endif
#if HAS_OBJECT
out float out_object;
#endif

// One pixel in units of uv.
float uv_footprint(vec2 uv, float z) {
    vec3 p = sample_in_camera(gl_FragCoord.xy + frame.jitter_px, z);
    float world_area = length(cross(dFdx(p), dFdy(p)));
    vec2 du = dFdx(uv), dv = dFdy(uv);
    return sqrt(abs(du.x * dv.y - du.y * dv.x) / max(world_area, 1e-30)) * pixel_footprint(z);
}

void main() {
    float z = 1.0 / gl_FragCoord.w;  // clip w is the planar depth; an interpolated copy would round more
    vec2 uv = vec2(0.0);
    vec4 tangent = vec4(0.0);
    float footprint_uv = 0.0;
#if TEXTURED
    uv = v_uv;
    footprint_uv = uv_footprint(uv, z);
#endif
#if NORMAL_MAPPED
    tangent = v_tangent;
#endif
    vec4 base = base_color_at(v_material, uv, footprint_uv);
#if ALPHA_MASKED
    if (base.a < material_at(v_material).alpha_cutoff) discard;
#endif
    float side = gl_FrontFacing ? 1.0 : -1.0;
    Surface s = surface_of(base.rgb, v_material, vec3(0.0), side, v_normal, tangent, uv, footprint_uv);
    out_base_color = vec4(s.base_color, s.metallic);
    out_normal = vec4(octahedral_encode(s.normal), s.roughness, 1.0);
    out_depth = z;
#if LOG_DEPTH
    gl_FragDepth = log2(z / frame.near_plane) / log2(SKY_DEPTH / frame.near_plane);
#endif
#if HAS_EMISSIVE
    out_emissive = vec4(min(s.emissive, LARGEST_RADIANCE), 1.0);  // what half floats hold of it
#endif
#if HAS_OBJECT
    out_object = float(v_object);
#endif
}
