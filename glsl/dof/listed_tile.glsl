// The tile that a work group draws: the next of the list of tiles of class TILE_CLASS.
// Reads: TileWork (tile_lists.comp).
#include "dof/tile_classes.glsl"

layout(std430) readonly buffer TileWork { uvec4 work[CLASSES]; uint tiles[]; };

// Its place in the picture of tiles, which has `size`; -1 for a group past the list's end.
ivec2 listed_tile(ivec2 size) {
    uint slot = group_of(gl_WorkGroupID.xy);
    if (slot >= work[TILE_CLASS].w) return ivec2(-1);
    uint tile = tiles[list_place(TILE_CLASS, slot, uint(size.x * size.y))];
    return ivec2(tile & 0xffffu, tile >> 16u);
}
