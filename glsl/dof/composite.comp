// Lays the traced near layer over what lies behind it, and leaves everything outside the ray mask to the post-process.
// Reads: coc (px), post (radiance; a: specular luminance of its near layer), post_behind (radiance behind that),
//   full resolution; far_blur (radiance; a: validity), mask (y: weight of rays), near_smooth, far_smooth
//   (premultiplied; a: share of light) or, without spatial reconstruction, near_light, far_light (likewise),
//   layer_state (z: hit ratio; w: 0 where nothing is held), half resolution.
// Writes: hybrid (radiance; a: share of the traced near layer, which moves otherwise than the surface behind it), full
//   resolution.
// Over: the tiles of RayTiles, those without rays by a kernel of their own.
// Method: poster, 2.3. Inside the mask, near + (1 - hit ratio) * behind. Behind is the sharp raster image where that
// is in focus, so that it keeps full resolution; else the traced far layer, which gives way to the post-process where
// almost all rays hit near. Bright specular bokeh of near surfaces stays the post-process'. The mask's feather hides
// its edge.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/catmull_rom.glsl"
#include "lib/coc.glsl"
#include "lib/hit_layers.glsl"
#include "lib/splat.glsl"
#include "dof/ray_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 16, local_size_y = 16) in;  // one tile
uniform sampler2D in_coc;
uniform sampler2D in_post;
uniform sampler2D in_post_behind;
uniform sampler2D in_far_blur;
uniform sampler2D in_mask;
#if HAS_NEAR_SMOOTH && HAS_FAR_SMOOTH
uniform sampler2D in_near_smooth;
uniform sampler2D in_far_smooth;
#define NEAR in_near_smooth
#define FAR in_far_smooth
#else
uniform sampler2D in_near_light;
uniform sampler2D in_far_light;
#define NEAR in_near_light
#define FAR in_far_light
#endif
uniform sampler2D in_layer_state;
layout(rgba16f) uniform writeonly image2D out_hybrid;

// Part of the cubic, the rest is linear. What the range takes off its negative lobes is light gained: 1.4 % of a bokeh
// with a bright rim, 2.3 % if the cubic were all; of what it mends, four fifths are mended here.
const float SHARPNESS = 0.6;
const float LEAST_WEIGHT = 1e-3;  // of the texels that hold anything: less is a rim where negative lobes outweigh them

#if TILE_CLASS == RAYS
// The traced layers at a full-res pixel.
struct Traced {
    vec4 near;    // premultiplied; a: share of light that it holds back from what lies behind
    vec4 far;     // premultiplied; a: 1 - near.a
    float ratio;  // hit ratio, accumulated
    float held;   // 0..1: part of the pixel's neighbourhood that holds any
};

// Half resolution is upsampled with a cubic, which keeps the rims of bright discs where they are, within the range of
// the four texels around, so that it makes no halo. Texels that hold nothing do not count.
Traced traced_at(vec2 half_position) {
    ivec2 last = textureSize(in_layer_state, 0) - 1, corner = ivec2(floor(half_position - 0.5));
    vec2 f = half_position - 0.5 - vec2(corner);
    vec4 near = vec4(0.0), near_low = vec4(LARGEST_RADIANCE), near_high = vec4(0.0);
    vec4 far = vec4(0.0), far_low = vec4(LARGEST_RADIANCE), far_high = vec4(0.0);
    float weight = 0.0, ratio = 0.0, held = 0.0;
    for (int i = 0; i < 16; i++) {
        ivec2 step = ivec2(i % 4, i / 4) - 1, texel = clamp(corner + step, ivec2(0), last);
        vec4 state = fetch_finite(in_layer_state, texel);
        if (state.w == 0.0) continue;
        vec4 near_there = fetch_finite(NEAR, texel), far_there = fetch_finite(FAR, texel);
        vec2 away = abs(f - vec2(step));
        float linear = max(1.0 - away.x, 0.0) * max(1.0 - away.y, 0.0);
        float cubic = mix(linear, catmull_rom(away.x) * catmull_rom(away.y), SHARPNESS);
        near += cubic * near_there;
        far += cubic * far_there;
        weight += cubic;
        if (linear == 0.0) continue;
        ratio += linear * state.z;
        held += linear;
        near_low = min(near_low, near_there);
        near_high = max(near_high, near_there);
        far_low = min(far_low, far_there);
        far_high = max(far_high, far_there);
    }
    if (held == 0.0) return Traced(vec4(0.0), vec4(0.0), 0.0, 0.0);
    near = clamp(near / max(weight, LEAST_WEIGHT), near_low, near_high);
    far = clamp(far / max(weight, LEAST_WEIGHT), far_low, far_high);
    float total = max(near.a + far.a, 1e-6);
    return Traced(near / total, far / total, ratio / held, held);
}

// The post-process' picture with the traced layers over it; a: share of the near one.
vec4 composed(ivec2 pixel, vec4 post) {
    vec2 half_position = 0.5 * (vec2(pixel) + 0.5), uv = half_position / vec2(textureSize(in_mask, 0));
    float feather = finite_radiance(textureLod(in_mask, uv, 0.0)).y;
    Traced traced = Traced(vec4(0.0), vec4(0.0), 0.0, 0.0);
    if (feather > 0.0) traced = traced_at(half_position);
    if (traced.held == 0.0) return vec4(post.rgb, 0.0);
    // Weights come from accumulated values only: the picture is linear in this frame's rays, and its mean unbiased.
    vec4 post_far = finite_radiance(textureLod(in_far_blur, uv, 0.0));
    float open = 1.0 - traced.near.a;
    float filtered = post_far_share(traced.ratio, frame.blend_hit_ratio) * post_far.a;
    float coc = fetch_finite(in_coc, pixel).r;
    float rasterised = float(RASTER_FOCUS) * raster_share(coc, IN_FOCUS_COC_PX, frame.focus_blend);
    vec3 behind = mix(traced.far.rgb, open * post_far.rgb, filtered);
    behind = mix(behind, open * fetch_light(in_post_behind, pixel).rgb, rasterised);
    float rays = feather * (1.0 - post_near_share(post.a, frame.blend_specular));
    vec3 color = mix(post.rgb, traced.near.rgb + behind, rays);
    return within_half(vec4(color, rays * clamp(traced.near.a, 0.0, 1.0)));
}
#endif

void main() {
    ivec2 tile = listed_tile(), pixel = texel_of(tile, 16);
    if (tile.x < 0 || any(greaterThanEqual(pixel, imageSize(out_hybrid)))) return;
    vec4 post = fetch_light(in_post, pixel);
#if TILE_CLASS == RAYS
    imageStore(out_hybrid, pixel, composed(pixel, post));
#else
    imageStore(out_hybrid, pixel, vec4(post.rgb, 0.0));
#endif
}
