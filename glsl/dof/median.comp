// Removes the gather's sampling noise without softening edges.
// Reads: far_gather (radiance; a: validity) and, if there is a near layer, near_gather (premultiplied; a: coverage),
// half resolution; tiles_dilated (px).
// Writes: far_blur, near_blur, half resolution.
// Method: 3x3 median per channel (Jimenez 2014, post filter). Only where the kernel's rings lie well apart is there
// noise. A median keeps no mean: of the bokeh of a small light it would take 4 to 7 %. So what it takes away is given
// back as the mean over 3x3 texels, and a picture keeps its light; on an edge it takes nothing, and blurs nothing.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/median.glsl"
#include "dof/spacing.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_far_gather;
uniform sampler2D in_tiles_dilated;
layout(rgba16f) uniform writeonly image2D out_far_blur;
#if HAS_NEAR_GATHER
uniform sampler2D in_near_gather;
layout(rgba16f) uniform writeonly image2D out_near_blur;
#endif

// Ring spacing above which the prefilter alone leaves taps visible.
const float NOISY_SPACING_PX = 5.0;

const int SIDE = 10;                    // of the work group, and of the texels around it
shared vec4 taken[SIDE * SIDE];         // by the median

vec4 median_at(sampler2D source, ivec2 texel, ivec2 last) {
    vec4 v[9];
    for (int i = 0; i < 9; i++) v[i] = fetch_light(source, clamp(texel + ivec2(i % 3, i / 3) - 1, ivec2(0), last));
    return median9(v);
}

// `source` at `texel`, filtered where a kernel of `radius` px is noisy; the whole work group calls it.
vec4 filtered(sampler2D source, ivec2 texel, float radius, ivec2 last) {
    vec4 value = fetch_light(source, min(texel, last));
    if (MEDIAN == 0 || ring_spacing(radius) <= NOISY_SPACING_PX) return value;
    barrier();
    for (int i = int(gl_LocalInvocationIndex); i < SIDE * SIDE; i += 64) {
        ivec2 there = clamp(ivec2(gl_WorkGroupID.xy) * 8 + ivec2(i % SIDE, i / SIDE) - 1, ivec2(0), last);
        taken[i] = fetch_light(source, there) - median_at(source, there, last);
    }
    barrier();
    ivec2 local = ivec2(gl_LocalInvocationID.xy);
    vec4 given = vec4(0.0);
    for (int i = 0; i < 9; i++) given += taken[(local.y + i / 3) * SIDE + local.x + i % 3];
    return clamp(value - taken[(local.y + 1) * SIDE + local.x + 1] + given / 9.0, 0.0, LARGEST_RADIANCE);
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), last = imageSize(out_far_blur) - 1;
    vec2 reach = fetch_finite(in_tiles_dilated, ivec2(gl_WorkGroupID.xy)).xy;
    bool inside = all(lessThanEqual(texel, last));
    vec4 far = filtered(in_far_gather, texel, max(-reach.x, reach.y), last);
    if (inside) imageStore(out_far_blur, texel, far);
#if HAS_NEAR_GATHER
    vec4 near = filtered(in_near_gather, texel, -reach.x, last);
    if (inside) imageStore(out_near_blur, texel, near);
#endif
}
