// Halves the G-buffer's resolution for the ray mask, once, so that the edge filter reads each block a single time.
// Reads: normal (world, octahedral; w: 1 on a surface), coc (signed radius, px), full resolution.
// Writes: mask_guide (xyz: mean normal, w: mean CoC, px), mask_slope (x: most negative CoC, px; yz: what CoC changes
//   per half-res px along x and y by the surface's own slope), half resolution.
// Over: the tiles of EdgeTiles; elsewhere what it writes is 0.
// Method: a 2x2 mean, which is also the first step of the poster's Gaussian; the slope by minmod (lib/mask.glsl).
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/mask.glsl"
#include "lib/octahedral.glsl"
#include "dof/edge_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_normal;
uniform sampler2D in_coc;
layout(rgba32f) uniform writeonly image2D out_mask_guide;
layout(rgba32f) uniform writeonly image2D out_mask_slope;

ivec2 last;  // index of the last full-res pixel

float coc_at(ivec2 pixel) {
    return fetch_finite(in_coc, min(pixel, last)).r;
}

// CoC change per half-res px that the surface at the block has by itself, along one axis; all four pixels within the
// picture.
float slope(ivec2 block, ivec2 axis) {
    float c[4];
    ivec2 first = clamp(2 * block - axis, ivec2(0), max(last - 3 * axis, ivec2(0)));
    for (int i = 0; i < 4; i++) c[i] = coc_at(first + i * axis);
    return 2.0 * own_slope(vec3(c[1] - c[0], c[2] - c[1], c[3] - c[2]));
}

void main() {
    ivec2 tile = listed_tile(), p = texel_of(tile, 8);
    if (tile.x < 0 || any(greaterThanEqual(p, imageSize(out_mask_guide)))) return;
    last = textureSize(in_coc, 0) - 1;
    vec4 sum = vec4(0.0);
    float nearest = 1e30;
    for (int i = 0; i < 4; i++) {
        ivec2 pixel = min(2 * p + ivec2(i & 1, i >> 1), last);
        vec4 normal = fetch_finite(in_normal, pixel);
        float coc = coc_at(pixel);
        sum += vec4(normal.w * octahedral_decode(normal.xy), coc);
        nearest = min(nearest, coc);
    }
    imageStore(out_mask_guide, p, 0.25 * sum);
    imageStore(out_mask_slope, p, vec4(nearest, slope(p, ivec2(1, 0)), slope(p, ivec2(0, 1)), 0.0));
}
