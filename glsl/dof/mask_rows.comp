// Dilates the edges along rows by how far their near blur reaches: the first half of an exact dilation by discs.
// Reads: mask_edges (x: response; y: reach, half-res px), mask_reach (farthest edge to look for, half-res px, per
//   tile).
// Writes: mask_rows (x: power of the strongest edge of the row, half-res px^2, negative if none reaches; y: its
//   reach; z: its response), half resolution.
// Method: a disc of radius r about e covers p exactly if its power r^2 - |p - e|^2 >= 0, and the largest power splits
// into a maximum along rows and one along columns (as the distance transform of Felzenszwalb and Huttenlocher 2012
// does, with radii): no pixel is lost and no square or tile shows.
layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_mask_edges;
uniform sampler2D in_mask_reach;
layout(rgba32f) uniform writeonly image2D out_mask_rows;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(out_mask_rows);
    if (any(greaterThanEqual(p, size))) return;
    int farthest = int(texelFetch(in_mask_reach, ivec2(gl_WorkGroupID.xy), 0).r);
    vec4 best = vec4(-1.0, 0.0, 0.0, 0.0);
    for (int x = max(p.x - farthest, 0); x <= min(p.x + farthest, size.x - 1) && farthest > 0; x++) {
        vec2 edge = texelFetch(in_mask_edges, ivec2(x, p.y), 0).xy;
        float distance = float(x - p.x);
        float power = edge.y * edge.y - distance * distance;
        if (edge.y > 0.0 && power > best.x) best = vec4(power, edge.y, edge.x, 0.0);
    }
    imageStore(out_mask_rows, p, best);
}
