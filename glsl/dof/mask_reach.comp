// Lets every tile learn how far it must look for edges whose near blur reaches it; run along rows, then along columns.
// Reads: reach (largest reach of an edge in the tile, half-res px; one texel per 8x8 half-res px).
// Writes: the same, of all edges that reach the tile along AXIS.
// Method: as dilate.comp, but without a limit: rays blur as far as the lens does.
#include "shared/fetch.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_reach;
#if AXIS == 0
layout(r32f) uniform writeonly image2D out_mask_reach_row;
#define OUT out_mask_reach_row
const ivec2 STEP = ivec2(1, 0);
#else
layout(r32f) uniform writeonly image2D out_mask_reach;
#define OUT out_mask_reach
const ivec2 STEP = ivec2(0, 1);
#endif

const float TILE = 8.0;  // half-res px

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), size = imageSize(OUT);
    if (any(greaterThanEqual(tile, size))) return;
    float farthest = 0.0;
    for (int i = 0; i < size[AXIS]; i++) {
        ivec2 there = tile + (i - tile[AXIS]) * STEP;
        float reach = fetch_finite(in_reach, there).r;
        float gap = TILE * float(abs(i - tile[AXIS])) - (TILE - 1.0);  // between the tiles' nearest pixels
        if (reach > 0.0 && reach >= gap) farthest = max(farthest, reach);
    }
    imageStore(OUT, tile, vec4(farthest));
}
