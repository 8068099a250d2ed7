// Turns depth into the signed circle of confusion, the one quantity every later pass compares.
// Reads: depth (m, planar, full resolution). Writes: coc (signed radius, full-res px, negative in front of focus, full
// resolution).
// Method: thin lens, Potmesil and Chakravarty 1982, in the form derived in app/optics.py.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/coc.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_depth;
layout(r32f) uniform writeonly image2D out_coc;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(out_coc)))) return;
    float depth = fetch_depth(in_depth, pixel);
    imageStore(out_coc, pixel, vec4(coc_px(depth, frame.coc_scale_px, frame.inverse_focus)));
}
