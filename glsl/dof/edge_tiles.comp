// Lists the tiles that the mask looks for edges in: those with near blur in or next to them, and a rim of one tile about
// them, which the edge filter and its smoothing reach into.
// Reads: tiles (x: most negative CoC, px; one texel per 16x16 px).
// Fills: EdgeTiles (list_tile.glsl).
#include "shared/fetch.glsl"
#include "lib/mask.glsl"
#include "dof/edge_tiles.glsl"
#include "dof/list_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_tiles;

const int AROUND = 2;  // tiles: a silhouette is an edge up to a texel beside it, and an edge sees no farther than a tile

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), size = textureSize(in_tiles, 0);
    if (any(greaterThanEqual(tile, size))) return;
    float nearest = 0.0;
    for (int y = -AROUND; y <= AROUND; y++) {
        for (int x = -AROUND; x <= AROUND; x++) {
            nearest = min(nearest, fetch_finite(in_tiles, clamp(tile + ivec2(x, y), ivec2(0), size - 1)).x);
        }
    }
    if (nearest < -RAYS_BEGIN_PX) list_tile(tile, 0u);
}
