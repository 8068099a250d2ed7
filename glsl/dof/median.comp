// Removes the gather's sampling noise without softening edges.
// Reads: near_gather (premultiplied; a: coverage), far_gather (radiance; a: validity), half resolution; tiles_dilated
// (px).
// Writes: near_blur, far_blur, half resolution.
// Method: 3x3 median per channel (Jimenez 2014, post filter). Only where the kernel's rings lie well apart is there
// noise; elsewhere a median would do nothing but round off small bokeh.
#include "shared/frame.glsl"
#include "lib/median.glsl"
#include "dof/spacing.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_near_gather;
uniform sampler2D in_far_gather;
uniform sampler2D in_tiles_dilated;
layout(rgba16f) uniform writeonly image2D out_near_blur;
layout(rgba16f) uniform writeonly image2D out_far_blur;

// Ring spacing above which the prefilter alone leaves taps visible. Below, a bokeh disc is so small that its rim, which
// the median wears down, holds too much of its light: 4 % of a point's light would be lost at 4 px.
const float NOISY_SPACING_PX = 5.0;

vec4 filtered(sampler2D source, ivec2 texel, float radius, ivec2 last) {
    if (MEDIAN == 0 || ring_spacing(radius) <= NOISY_SPACING_PX) return texelFetch(source, texel, 0);
    vec4 v[9];
    for (int i = 0; i < 9; i++) v[i] = texelFetch(source, clamp(texel + ivec2(i % 3, i / 3) - 1, ivec2(0), last), 0);
    return median9(v);
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), last = imageSize(out_near_blur) - 1;
    if (any(greaterThan(texel, last))) return;
    vec2 reach = texelFetch(in_tiles_dilated, ivec2(gl_WorkGroupID.xy), 0).xy;
    imageStore(out_near_blur, texel, filtered(in_near_gather, texel, -reach.x, last));
    imageStore(out_far_blur, texel, filtered(in_far_gather, texel, max(-reach.x, reach.y), last));
}
