// The tile that a work group draws: the next of a list's tiles of kind TILE_CLASS.
// Reads: the block LIST, with lists of CLASSES kinds of tiles (list_tile.glsl filled it).
#include "shared/frame.glsl"
#include "lib/tile.glsl"
#include "lib/work_list.glsl"

layout(std430) readonly buffer LIST { uvec4 work[CLASSES]; uint tiles[]; };

// Its place in the picture of tiles; -1 for a group past the list's end.
ivec2 listed_tile() {
    ivec2 size = tile_count(frame.size_px);
    uint slot = group_of(gl_WorkGroupID.xy);
    if (slot >= work[TILE_CLASS].w) return ivec2(-1);
    uint tile = tiles[list_place(TILE_CLASS, slot, uint(size.x * size.y))];
    return ivec2(tile & 0xffffu, tile >> 16u);
}

// This invocation's texel of it, where a work group covers a tile of `side` texels a side.
ivec2 texel_of(ivec2 tile, int side) {
    return side * tile + ivec2(gl_LocalInvocationID.xy);
}
