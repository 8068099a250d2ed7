// Lists the tiles of each class, for the passes that draw a class at a time.
// Reads: tiles_dilated (most negative and largest CoC that reaches the tile, full-res px).
// Writes: TileWork: per class the group counts of a dispatch of one group a tile, and how many tiles; then the lists
//   one after the other, each with room for all tiles, x | y << 16.
// Method: one invocation a tile appends it by an atomic; which place a tile gets differs from run to run, what is drawn
// in it does not. Without TILE_CLASSES all are MIXED: one general kernel draws everything.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "dof/tile_classes.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_tiles_dilated;
layout(std430) buffer TileWork { uvec4 work[CLASSES]; uint tiles[]; };

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), size = textureSize(in_tiles_dilated, 0);
    if (any(greaterThanEqual(tile, size))) return;
    uint class_ = TILE_CLASSES == 1 ? tile_class(fetch_finite(in_tiles_dilated, tile).xy) : MIXED;
    uint slot = atomicAdd(work[class_].w, 1u);
    uvec2 needed = folded_groups(slot + 1u);
    atomicMax(work[class_].x, needed.x);
    atomicMax(work[class_].y, needed.y);
    tiles[list_place(class_, slot, uint(size.x * size.y))] = uint(tile.x) | uint(tile.y) << 16u;
}
