// Lists the tiles that the mask looks for edges in: those with near blur in them, and a rim of one tile about them.
// Reads: tiles (x: most negative CoC that the post-process gathers, px; one texel per 16x16 px).
// Fills: EdgeTiles (list_tile.glsl).
// Method: exact. An edge lies up to 1 half-res px beside near blur, its filter reaches 2 and their smoothing 3 px
// farther: 6 in all, less than a tile's 8. What the post-process gathers may be less than rays begin at: a CoC at that
// limit may stand for any beyond it.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/mask.glsl"
#include "dof/edge_tiles.glsl"
#include "dof/list_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_tiles;

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), size = tile_count(frame.size_px);
    if (any(greaterThanEqual(tile, size))) return;
    float nearest = 0.0;
    for (int i = 0; i < 9; i++) {
        ivec2 there = clamp(tile + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
        nearest = min(nearest, fetch_finite(in_tiles, there).x);
    }
    if (nearest <= -min(RAYS_BEGIN_PX, frame.max_coc_px)) list_tile(tile, uint(TILE_CLASS));
}
