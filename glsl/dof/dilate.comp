// Lets every tile learn of every circle of confusion that reaches it; run along rows, then along columns.
// Reads: extent (x: most negative, y: largest signed CoC, px, one texel per 16x16 px). Writes: the same, dilated along
// AXIS.
// Method: exact. A CoC reaches a square of tiles, and a larger CoC a larger square about the same tile. Along the rows
// each tile takes the largest CoC among those that reach it; along the columns that maximum reaches at least as far as
// any of the CoCs it replaced, and it really does reach there: the square is a product of intervals. So two
// one-dimensional passes equal the two-dimensional search.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/tile_reach.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_extent;
#if AXIS == 0
layout(rg32f) uniform writeonly image2D out_tiles_row;
#define OUT out_tiles_row
const ivec2 STEP = ivec2(1, 0);
#else
layout(rg32f) uniform writeonly image2D out_tiles_dilated;
#define OUT out_tiles_dilated
const ivec2 STEP = ivec2(0, 1);
#endif

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), size = imageSize(OUT);
    if (any(greaterThanEqual(tile, size))) return;
    vec2 extent = fetch_finite(in_extent, tile).xy;
    int farthest = tile_reach(frame.max_coc_px);
    for (int distance = 1; distance <= farthest; distance++) {
        for (int side = -1; side <= 1; side += 2) {
            ivec2 there = tile + side * distance * STEP;
            if (any(lessThan(there, ivec2(0))) || any(greaterThanEqual(there, size))) continue;
            vec2 other = fetch_finite(in_extent, there).xy;
            if (tile_reach(-other.x) >= distance) extent.x = min(extent.x, other.x);
            if (tile_reach(other.y) >= distance) extent.y = max(extent.y, other.y);
        }
    }
    imageStore(OUT, tile, vec4(extent, 0.0, 0.0));
}
