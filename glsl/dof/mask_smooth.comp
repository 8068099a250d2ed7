// Smooths what the mask finds edges in, along one axis, so that noise and aliasing call for no rays.
// Reads: guide (xyz: normal, w: CoC, px; means over 2x2 px, half resolution).
// Writes: the same after a Gaussian along x (AXIS 0) or y (AXIS 1).
// Over: the tiles of EdgeTiles; elsewhere what it writes is 0.
// Method: poster (Tan et al. 2020), 2.1, "a Gaussian on the G-buffer", as two separable passes.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "dof/beyond.glsl"
#include "dof/edge_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_guide;
#if AXIS == 0
layout(rgba32f) uniform writeonly image2D out_mask_smooth_row;
#define OUT out_mask_smooth_row
#else
layout(rgba32f) uniform writeonly image2D out_mask_smooth;
#define OUT out_mask_smooth
#endif

const int REACH = 3;  // two standard deviations of the Gaussian's largest setting, 3 px = 1.5 half-res px
const ivec2 ALONG = ivec2(1 - AXIS, AXIS);

void main() {
    ivec2 tile = listed_tile(), p = texel_of(tile, 8);
    if (tile.x < 0 || any(greaterThanEqual(p, imageSize(OUT)))) return;
    float sigma = 0.5 * frame.mask_smoothing;
    vec4 sum = fetch_finite(in_guide, p);
    float weights = 1.0;
    for (int i = 1; i <= REACH; i++) {
        float weight = exp(-0.5 * float(i * i) / max(sigma * sigma, 1e-4));
        sum += weight * (within_or_beyond(in_guide, p - i * ALONG) + within_or_beyond(in_guide, p + i * ALONG));
        weights += 2.0 * weight;
    }
    imageStore(OUT, p, sum / weights);
}
