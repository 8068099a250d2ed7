// Lists the tiles of each class, for the passes that draw a class at a time.
// Reads: tiles_dilated (most negative and largest CoC that reaches the tile, full-res px).
// Fills: TileWork (list_tile.glsl).
// Without TILE_CLASSES all are MIXED: one general kernel draws everything. NEAR_LAYER, FAR_LAYER: whether the plan has
// what such tiles need.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "dof/tile_classes.glsl"
#include "dof/list_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_tiles_dilated;

// A tile's reach as far as this plan has kernels for it: rounding must not put a tile into a list that nobody draws.
vec2 layered(vec2 reach) {
    if (NEAR_LAYER == 0) reach.x = max(reach.x, -HALF_RES_BEGIN_PX);
    if (FAR_LAYER == 0) reach.y = min(reach.y, HALF_RES_BEGIN_PX);
    return reach;
}

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), size = tile_count(frame.size_px);
    if (any(greaterThanEqual(tile, size))) return;
    uint class_ = TILE_CLASSES == 1 ? tile_class(layered(fetch_finite(in_tiles_dilated, tile).xy)) : MIXED;
    list_tile(tile, class_);
}
