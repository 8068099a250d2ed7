// Completes the ray mask: dilates along columns, and counts how often each response occurs.
// Reads: mask_rows (x: power, half-res px^2; y: reach, half-res px; z: response), mask_reach (farthest edge to look
//   for, half-res px, per tile).
// Writes: mask (x: response in steps of 1/255, 0: no rays; y: weight of rays in the composite, 0..1), half resolution.
// Fills: RayHistogram (masked pixels per response step).
// Method: see mask_rows.comp. Counts are integers, so that they come out the same in any order.
#include "lib/mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_mask_rows;
uniform sampler2D in_mask_reach;
layout(rg16f) uniform writeonly image2D out_mask;
layout(std430) buffer RayHistogram { uint pixels_of_level[256]; };

shared uint counted[256];

// Response and feather at p, from the rows above and below.
vec2 dilated(ivec2 p, int height) {
    int farthest = int(texelFetch(in_mask_reach, ivec2(gl_WorkGroupID.xy), 0).r);
    vec2 best = vec2(0.0);
    for (int y = max(p.y - farthest, 0); y <= min(p.y + farthest, height - 1) && farthest > 0; y++) {
        vec4 row = texelFetch(in_mask_rows, ivec2(p.x, y), 0);
        float distance = float(y - p.y);
        float power = row.x - distance * distance;
        if (power >= 0.0) best = max(best, vec2(row.z, rays_feather(power, row.y)));
    }
    return best;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(out_mask);
    uint lane = gl_LocalInvocationIndex;
    for (uint level = lane; level < 256u; level += 64u) counted[level] = 0u;
    barrier();
    if (all(lessThan(p, size))) {
        vec2 mask = dilated(p, size.y);
        uint level = mask.x > 0.0 ? clamp(uint(255.0 * mask.x + 0.5), 1u, 255u) : 0u;
        imageStore(out_mask, p, vec4(float(level) / 255.0, mask.y, 0.0, 0.0));
        if (level > 0u) atomicAdd(counted[level], 1u);
    }
    barrier();
    for (uint level = lane; level < 256u; level += 64u) {
        if (counted[level] > 0u) atomicAdd(pixels_of_level[level], counted[level]);
    }
}
