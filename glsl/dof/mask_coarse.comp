// Lowers the mask's resolution as far as the largest circle of confusion allows: each coarse texel keeps the edges of
// its square of half-res texels as one.
// Reads: mask_edges (x: response; y: reach, half-res px; half resolution), MaskReach (the largest reach, half-res px).
// Writes: mask_coarse (x: response; y: reach about the coarse texel's centre, half-res px), in its lower left corner,
//   one texel per 2^level x 2^level half-res px.
// Method: poster, section 3: the mask's resolution follows the largest CoC, so that the search for edges stays as long
// at any blur and any picture size, and what is coarse is always small beside the blur. Reaches grow by the distance to
// the square's centre: no pixel that an edge reaches is lost.
#include "shared/fetch.glsl"
#include "lib/mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_mask_edges;
layout(rg16f) uniform writeonly image2D out_mask_coarse;
layout(std430) readonly buffer MaskReach { float largest_reach; };

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(out_mask_coarse);
    int side = 1 << mask_level(largest_reach);
    ivec2 corner = side * texel;
    if (any(greaterThanEqual(corner, size))) return;
    vec2 strongest = vec2(0.0);
    for (int i = 0; i < side * side; i++) {
        ivec2 p = corner + ivec2(i % side, i / side);
        if (all(lessThan(p, size))) strongest = max(strongest, fetch_finite(in_mask_edges, p).xy);
    }
    if (strongest.y > 0.0) strongest.y += coarse_margin_half(side);
    imageStore(out_mask_coarse, texel, vec4(strongest, 0.0, 0.0));
}
