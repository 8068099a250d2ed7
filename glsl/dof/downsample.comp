// Halves the resolution: each 2x2 block becomes one sample of one surface.
// Reads: lit (radiance; a: specular luminance), coc (px), both full resolution.
// Writes: half_color (radiance; a: signed CoC, full-res px), half_specular (specular luminance, lit scenes only), half
// resolution.
// Method: a mean of foreground and background colours would belong to neither (Jimenez 2014), so the block takes one
// pixel's CoC and the mean of the pixels that share it. Which pixel goes round with the frames: after four frames every
// pixel has stood for its block once, so thin features keep their share of the picture, where choosing the nearest
// would grow them and choosing the farthest would erase them.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/splat.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_lit;
uniform sampler2D in_coc;
layout(rgba16f) uniform writeonly image2D out_half_color;
#if HAS_HALF_SPECULAR
layout(r16f) uniform writeonly image2D out_half_specular;
#endif

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(out_half_color)))) return;
    ivec2 last = textureSize(in_coc, 0) - 1;
    vec4 color[4];
    float coc[4];
    for (int i = 0; i < 4; i++) {
        ivec2 pixel = min(2 * texel + ivec2(i & 1, i >> 1), last);
        color[i] = fetch_light(in_lit, pixel);
        coc[i] = gathered_coc(fetch_finite(in_coc, pixel).r, frame.max_coc_px);
    }
    const uint DIAGONALS_FIRST[4] = uint[4](0u, 3u, 1u, 2u);  // two frames already see both columns and both rows
    // One step further every four frames: the first coordinate of the sub-pixel jitter (R2, 0.7549 a frame) repeats
    // almost exactly after four.
    float chosen = coc[DIAGONALS_FIRST[(frame.frame_index + frame.frame_index / 4u) & 3u]];
    vec4 sum = vec4(0.0);
    float weight = 0.0;
    for (int i = 0; i < 4; i++) {
        float same = 1.0 - smoothstep(0.0, 1.0, abs(coc[i] - chosen) / frame.layer_fade_px);
        sum += same * color[i];
        weight += same;
    }
    sum /= weight;  // at least 1: the chosen pixel itself
    imageStore(out_half_color, texel, vec4(sum.rgb, chosen));
#if HAS_HALF_SPECULAR
    imageStore(out_half_specular, texel, vec4(sum.a));
#endif
}
