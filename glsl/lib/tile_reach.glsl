// How far a tile's circles of confusion reach, in tiles. Float64 twin: tests/gpu/post_twin.py.
#include "lib/coc.glsl"
#include "lib/tile.glsl"

const float REACH_MARGIN_PX = 3.0;  // a splat is drawn with half-res texels (2 px), upsampled bilinearly (1 px more)

// The largest number of tiles between a tile and one that a CoC of `radius` px in it can touch, along either axis.
// Pixels of tiles n apart lie more than (n - 1) tile widths apart. What is in focus stays where it is.
int tile_reach(float radius) {
    return radius <= IN_FOCUS_COC_PX ? 0 : 1 + int(floor((radius + REACH_MARGIN_PX) / TILE_PX));
}
