// Puts the blurred picture together at full resolution: what is sharp, what is blurred behind it, and the near layer
// over both.
// Reads: lit (radiance), coc (px), full resolution; tiles_dilated (px); as far as anything is blurred at half
//   resolution: far_blur (radiance; a: validity), half_color (a: CoC, px), near_blur (premultiplied; a: coverage),
//   near_specular (luminance, lit scenes only).
// Over: the tiles of TileWork, a class at a time.
// Writes: post (radiance; a: specular luminance of the near layer, premultiplied); post_behind (radiance behind the
//   near layer; a: 1 where anything was seen) if the hybrid reads it; full resolution.
// Method: upsampling and composite of Jimenez 2014. The half-res picture behind the near layer is weighted by CoC
// (joint bilateral upsampling, Kopf et al. 2007), so that no surface takes colour from another across a silhouette.
// A class of tiles (tile_classes.glsl) has a kernel with what they can hold: BLURRED, NEAR_LAYER, FAR_LAYER.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "dof/tile_classes.glsl"
#include "dof/listed_tile.glsl"
#include "dof/slight_focus.glsl"

layout(local_size_x = 16, local_size_y = 16) in;  // one tile
uniform sampler2D in_lit;
uniform sampler2D in_coc;
uniform sampler2D in_tiles_dilated;
#if HAS_FAR_BLUR && HAS_HALF_COLOR
uniform sampler2D in_far_blur;
uniform sampler2D in_half_color;
#endif
#if HAS_NEAR_BLUR
uniform sampler2D in_near_blur;
#endif
layout(rgba16f) uniform writeonly image2D out_post;
#if HAS_POST_BEHIND
layout(rgba16f) uniform writeonly image2D out_post_behind;
#endif
#if HAS_NEAR_SPECULAR
uniform sampler2D in_near_specular;
#endif

const float OTHER_SURFACE = 1e-3;  // weight of a texel of another surface: counts only if all four are

#if NEAR_LAYER || FAR_LAYER
// What lies behind the near layer at `pixel`, from half resolution; a: validity.
vec4 upsampled(ivec2 pixel, float own) {
    ivec2 last = textureSize(in_far_blur, 0) - 1;
    vec2 position = (vec2(pixel) + 0.5) * 0.5 - 0.5;
    ivec2 corner = ivec2(floor(position));
    vec2 f = position - vec2(corner);
    vec4 sum = vec4(0.0);
    float weight = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 side = ivec2(i & 1, i >> 1);
        ivec2 texel = clamp(corner + side, ivec2(0), last);
        vec2 bilinear = mix(1.0 - f, f, vec2(side));
        float apart = abs(fetch_sample(in_half_color, texel).a - own);
        float same = 1.0 - smoothstep(0.0, frame.layer_fade_px, apart);
        float w = bilinear.x * bilinear.y * max(same, OTHER_SURFACE);
        sum += w * fetch_light(in_far_blur, texel);
        weight += w;
    }
    return sum / weight;
}
#endif

void store(ivec2 pixel, vec4 color, vec4 behind) {
    imageStore(out_post, pixel, color);
#if HAS_POST_BEHIND
    imageStore(out_post_behind, pixel, behind);
#endif
}

void main() {
    ivec2 tile = listed_tile(), pixel = texel_of(tile, 16);
    if (tile.x < 0 || any(greaterThanEqual(pixel, imageSize(out_post)))) return;
    vec4 sharp = fetch_light(in_lit, pixel);
    vec3 behind = sharp.rgb;
    float validity = 1.0, specular = 0.0;
    vec4 near = vec4(0.0);
#if BLURRED
    vec2 reach = fetch_finite(in_tiles_dilated, tile).xy;
    float own = gathered_coc(fetch_finite(in_coc, pixel).r, frame.max_coc_px);
    float half_res = smoothstep(HALF_RES_BEGIN_PX, HALF_RES_END_PX, abs(own));
#if SLIGHT_FOCUS
    float radius = max(min(abs(own), HALF_RES_END_PX), clamp(-reach.x, 0.0, HALF_RES_END_PX));
    if (half_res < 1.0 && radius > IN_FOCUS_COC_PX) behind = slight_focus(in_lit, in_coc, pixel, own, radius);
#endif
#endif
#if NEAR_LAYER || FAR_LAYER
    if (half_res > 0.0) {
        vec4 blurred = upsampled(pixel, own);
        behind = mix(behind, blurred.rgb, half_res);
        validity = mix(1.0, blurred.a, half_res);
    }
#endif
#if NEAR_LAYER
    vec2 uv = (vec2(pixel) + 0.5) * 0.5 / vec2(textureSize(in_near_blur, 0));
    near = finite_radiance(textureLod(in_near_blur, uv, 0.0));
#if HAS_NEAR_SPECULAR
    specular = finite_radiance(textureLod(in_near_specular, uv, 0.0)).r;
#endif
#endif
    // Where nothing behind the near layer was seen, the near layer is all there is to show.
    float open = max(1.0 - near.a, 0.0) * validity;
    vec3 color = (near.rgb + open * behind) / max(near.a + open, 1e-6);
    store(pixel, vec4(color, specular), vec4(behind, validity));
}
