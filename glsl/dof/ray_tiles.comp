// Lists tiles by whether any ray may be called for in or next to them, for the passes that make and lay traced layers.
// Reads: mask_reach (farthest edge that reaches the tile, half-res px) and scout (x: share of rays that find unseen
//   near surfaces), one texel per 16x16 px, as far as there are any; without mask_reach rays go everywhere.
// Fills: RayTiles (list_tile.glsl).
// Method: conservative. A pixel of the mask takes its edges from its own tile's reach and its scouts from the tiles
// around it (mask.comp), whose spline is at most their largest, but for rounding. The composite interpolates up to a
// texel from the tile next to it.
#include "shared/fetch.glsl"
#include "lib/mask.glsl"
#include "dof/ray_tiles.glsl"
#include "dof/list_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
#if HAS_MASK_REACH
uniform sampler2D in_mask_reach;
#endif
#if HAS_SCOUT
uniform sampler2D in_scout;
#endif

const int AROUND = 2;  // tiles: one from scouts to the mask of a pixel, one from there to what is interpolated

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), size = tile_count(frame.size_px);
    if (any(greaterThanEqual(tile, size))) return;
    uint class_ = uint(RAYS);
#if HAS_MASK_REACH
    float reach = 0.0, found = 0.0;
    for (int y = -AROUND; y <= AROUND; y++) {
        for (int x = -AROUND; x <= AROUND; x++) {
            ivec2 there = clamp(tile + ivec2(x, y), ivec2(0), size - 1);
            if (max(abs(x), abs(y)) < AROUND) reach = max(reach, fetch_finite(in_mask_reach, there).r);
#if HAS_SCOUT
            found = max(found, fetch_finite(in_scout, there).x);
#endif
        }
    }
    if (reach == 0.0 && scouted_share(1.001 * found) == 0.0) class_ = uint(NO_RAYS);
#endif
    list_tile(tile, class_);
}
