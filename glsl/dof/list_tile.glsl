// Lists tiles by kind, for the passes that draw a kind at a time (listed_tile.glsl).
// Fills: the block LIST, with lists of CLASSES kinds of tiles: per kind the group counts of a dispatch of one group a
//   tile, and how many tiles; then the lists one after the other, each with room for all tiles, x | y << 16.
// Method: one invocation a tile appends it by an atomic; which place a tile gets differs from run to run, what is drawn
// in it does not.
#include "shared/frame.glsl"
#include "lib/tile.glsl"
#include "lib/work_list.glsl"

layout(std430) buffer LIST { uvec4 work[CLASSES]; uint tiles[]; };

void list_tile(ivec2 tile, uint class_) {
    ivec2 size = tile_count(frame.size_px);
    uint slot = atomicAdd(work[class_].w, 1u);
    uvec2 needed = folded_groups(slot + 1u);
    atomicMax(work[class_].x, needed.x);
    atomicMax(work[class_].y, needed.y);
    tiles[list_place(class_, slot, uint(size.x * size.y))] = uint(tile.x) | uint(tile.y) << 16u;
}
