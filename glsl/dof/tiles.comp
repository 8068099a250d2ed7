// Finds the nearest and the farthest circle of confusion in each tile, so that later passes know how far to look.
// Reads: coc (signed radius, px, full resolution).
// Writes: tiles (x: most negative, y: largest, px, clamped to what the post-process gathers; one texel per 16x16 px).
// Method: one work group per tile, reduction in shared memory; Jimenez 2014, tile pass.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/splat.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // each lane takes 2x2 of the tile's 16x16 px
uniform sampler2D in_coc;
layout(rg32f) uniform writeonly image2D out_tiles;

shared vec2 extent[64];  // x: smallest, y: largest

vec2 wider(vec2 a, vec2 b) {
    return vec2(min(a.x, b.x), max(a.y, b.y));
}

// Joins `count` neighbouring entries, `stride` apart, of each run into its first.
void join(int count, int stride) {
    int first = int(gl_LocalInvocationIndex) * count * stride;
    barrier();
    if (first >= 64) return;
    vec2 joined = extent[first];
    for (int i = 1; i < count; i++) joined = wider(joined, extent[first + i * stride]);
    extent[first] = joined;
}

void main() {
    ivec2 last = textureSize(in_coc, 0) - 1;
    vec2 own = vec2(3.4e38, -3.4e38);
    for (int i = 0; i < 4; i++) {
        // A texel beyond the picture's edge repeats the edge, which changes neither extreme.
        ivec2 pixel = min(2 * ivec2(gl_GlobalInvocationID.xy) + ivec2(i & 1, i >> 1), last);
        own = wider(own, vec2(gathered_coc(fetch_finite(in_coc, pixel).r, frame.max_coc_px)));
    }
    extent[gl_LocalInvocationIndex] = own;
    join(8, 1);
    join(8, 8);
    if (gl_LocalInvocationIndex == 0u) imageStore(out_tiles, ivec2(gl_WorkGroupID.xy), vec4(extent[0], 0.0, 0.0));
}
