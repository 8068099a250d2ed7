// Gives each masked pixel its rays of this frame and lists the pixels that have any.
// Reads: mask (x: response, steps of 1/255), RayBudget (rays per step), last frame's ray_count.
// Writes: ray_count (x: rays this frame; y: rays of earlier frames, which is the index of the first sample), half
//   resolution.
// Fills: RayWork (dispatch of groups of 64, number of pixels, pixels as x | y << 16).
// Method: the planned mean is rounded up or down at random in proportion, by a golden-ratio sequence in time with a
// random start per pixel. A work group appends its pixels together, so that neighbours are traced together.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/mask.glsl"
#include "lib/sampling.glsl"
#include "lib/work_list.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_mask;
uniform sampler2D prev_ray_count;
layout(rg32f) uniform writeonly image2D out_ray_count;
layout(std430) readonly buffer RayBudget { float rays_per_level; };
layout(std430) buffer RayWork { uint groups[3]; uint pixel_count; uint pixels[]; };

const uint GOLDEN = 0x9e3779b9u;   // 2^32 / golden ratio: every run of frames is spread evenly
const float WRAP = 16777216.0;     // counts stay exact in float32 below 2^24
const uint ROUNDING_STREAM = 0x5bd1e995u;  // sets the rounding's hash apart from the samples' seed

shared uint listed, first_slot;

float rays_for(ivec2 p) {
    float level = round(255.0 * fetch_light(in_mask, p).x);
    if (level == 0.0) return 0.0;
    uint random = pixel_seed(uvec2(p), frame.seed ^ ROUNDING_STREAM) + frame.frame_index * GOLDEN;
    float planned = planned_rays(level, rays_per_level, min(1.0, frame.ray_budget), float(frame.max_rays));
    return floor(planned + float(random >> 8u) / 16777216.0);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(p, imageSize(out_ray_count)));
    if (gl_LocalInvocationIndex == 0u) listed = 0u;
    barrier();
    float rays = inside ? rays_for(p) : 0.0;
    uint slot = rays > 0.0 ? atomicAdd(listed, 1u) : 0u;
    if (inside) {
        vec2 before = frame.history_valid != 0u ? fetch_finite(prev_ray_count, p).xy : vec2(0.0);
        imageStore(out_ray_count, p, vec4(rays, mod(before.x + before.y, WRAP), 0.0, 0.0));
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u && listed > 0u) {
        first_slot = atomicAdd(pixel_count, listed);
        uvec2 needed = groups_over(first_slot + listed);
        atomicMax(groups[0], needed.x);
        atomicMax(groups[1], needed.y);
    }
    barrier();
    if (rays > 0.0) pixels[first_slot + slot] = uint(p.x) | uint(p.y) << 16u;
}
