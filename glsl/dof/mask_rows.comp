// Dilates the edges along rows by how far their near blur reaches: the first half of an exact dilation by discs.
// Reads: mask_coarse (x: response; y: reach, half-res px; 2^level half-res px a texel), mask_reach (farthest edge to
//   look for, half-res px, per tile), MaskReach (the largest reach, half-res px).
// Writes: mask_rows (x: power of the strongest edge of the coarse row, half-res px^2, negative if none reaches; y: its
//   reach; z: its response; w: half-res px a coarse row), half resolution along the row, one row per coarse row.
// Method: a disc of radius r about e covers p exactly if its power r^2 - |p - e|^2 >= 0, and the largest power splits
// into a maximum along rows and one along columns (as the distance transform of Felzenszwalb and Huttenlocher 2012
// does, with radii): no pixel is lost and no square or tile shows.
#include "shared/fetch.glsl"
#include "lib/mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_mask_coarse;
uniform sampler2D in_mask_reach;
layout(rgba32f) uniform writeonly image2D out_mask_rows;
layout(std430) readonly buffer MaskReach { float largest_reach; };

// The farthest edge that reaches the coarse row's part of this work group.
float farthest_of(int side) {
    ivec2 tile = ivec2(gl_WorkGroupID.xy), last = textureSize(in_mask_reach, 0) - 1;
    float farthest = 0.0;
    for (int y = tile.y * side; y < (tile.y + 1) * side; y++) {
        farthest = max(farthest, fetch_finite(in_mask_reach, min(ivec2(tile.x, y), last)).r);
    }
    return farthest;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(out_mask_rows);
    int side = 1 << mask_level(largest_reach);
    if (p.x >= size.x || p.y * side >= size.y) return;
    float farthest = farthest_of(side);
    ivec2 span = coarse_span(p.x, farthest, side, size.x);
    vec4 best = vec4(-1.0, 0.0, 0.0, float(side));
    for (int x = span.x; x <= span.y && farthest > 0.0; x++) {
        vec2 edge = fetch_finite(in_mask_coarse, ivec2(x, p.y)).xy;
        float distance = coarse_center(x, side) - float(p.x);
        float power = edge.y * edge.y - distance * distance;
        if (edge.y > 0.0 && power > best.x) best = vec4(power, edge.y, edge.x, best.w);
    }
    imageStore(out_mask_rows, p, best);
}
