// How the post-process divides the CoC range among its paths, for the passes that must agree about it.
#include "lib/coc.glsl"
#include "lib/splat.glsl"

// |CoC| at which half resolution begins and ends taking over from full resolution. Half a resolution's texel is 2 px:
// below 2 px of radius it cannot draw the blur, from 4 px its own softness (about 1 px, standard deviation) adds less
// than a tenth. Without the full-resolution path the blur starts at the rim of the focus zone.
#if SLIGHT_FOCUS
const float HALF_RES_BEGIN_PX = 2.0;
const float HALF_RES_END_PX = 4.0;
#else
const float HALF_RES_BEGIN_PX = IN_FOCUS_COC_PX;
const float HALF_RES_END_PX = 2.0;
#endif

// Share of a sample that the half-resolution near layer draws.
float near_layer_share(float coc) {
    return front_share(coc, HALF_RES_BEGIN_PX, HALF_RES_END_PX);
}
