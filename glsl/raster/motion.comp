// Where each pixel's surface was on screen last frame, under a moving camera and on moving objects.
// Reads (full resolution): in_depth (planar, m), in_object (index of the moving object) where the scene has any.
// Writes (full resolution): out_motion (px): position now minus position last frame, both without jitter.
// Method: reprojection (Scherzer et al. 2007, section 3).
#include "shared/primary.glsl"
#include "shared/objects.glsl"
#include "shared/fetch.glsl"
#include "lib/coc.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_depth;
#if HAS_OBJECT
uniform sampler2D in_object;
#endif
layout(rg16f) writeonly uniform image2D out_motion;

const float OFF_SCREEN = 16384.0;  // px, of what was behind the last camera: beyond any image, within float16

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px)))) return;
    float z = fetch_depth(in_depth, pixel);
    vec2 now = vec2(pixel) + 0.5 + frame.jitter_px;
    // The sky is a direction, which only turns: w = 0 drops the camera's translation.
    vec3 point = camera_to_world(sample_in_camera(now, z));
#if HAS_OBJECT
    point = previous_position(uint(fetch_finite(in_object, pixel).r), point);
#endif
    vec4 position = vec4(point, 1.0);
    if (z >= SKY_DEPTH) position = vec4(mat3(frame.view_to_world) * vec3(pinhole_slope(now), -1.0), 0.0);
    vec4 before = frame.prev_view_proj * position;
    vec2 motion = before.w > 0.0 ? now - (0.5 * before.xy / before.w + 0.5) * frame.size_px : vec2(OFF_SCREEN);
    imageStore(out_motion, pixel, vec4(clamp(motion, -OFF_SCREEN, OFF_SCREEN), 0.0, 0.0));
}
