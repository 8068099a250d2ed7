// Lights the G-buffer with the same shade() that lights ray hits.
// Reads (full resolution): base_color (linear, a: metallic), normal (octahedral, roughness, coverage), depth (planar,
//   m), emissive (linear radiance) where the scene has any.
// Writes (full resolution): lit (linear radiance; a: luminance of its specular part).
// Method: deferred shading (Saito and Takahashi 1990); shade() in shared/shade.glsl.
#include "shared/primary.glsl"
#include "shared/shade.glsl"
#include "shared/fetch.glsl"
#include "lib/coc.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_base_color;
uniform sampler2D in_normal;
uniform sampler2D in_depth;
#if HAS_EMISSIVE
uniform sampler2D in_emissive;
#endif
layout(rgba16f) writeonly uniform image2D out_lit;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px)))) return;
    float z = fetch_depth(in_depth, pixel);
    vec3 position = camera_to_world(sample_in_camera(vec2(pixel) + 0.5 + frame.jitter_px, z));
    vec3 view_dir = normalize(frame.lens_eye - position);
    if (z >= SKY_DEPTH) {
        imageStore(out_lit, pixel, vec4(sky_radiance(-view_dir), 0.0));
        return;
    }
    vec4 base = min(fetch_light(in_base_color, pixel), 1.0);  // reflects no more than it receives
    vec4 normal = fetch_finite(in_normal, pixel);
    Surface s = Surface(position, octahedral_decode(normal.xy), base.rgb, base.a, normal.z, vec3(0.0));
#if HAS_EMISSIVE
    s.emissive = fetch_light(in_emissive, pixel).rgb;
#endif
    imageStore(out_lit, pixel, shade(s, view_dir));
}
