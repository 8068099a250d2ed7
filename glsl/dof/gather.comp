// Collects, for each half-res texel, the light of every sample whose circle of confusion covers it: a near layer with
// coverage, and what lies behind.
// Reads: prefiltered (radiance; a: signed radius left to draw, px; half resolution), tiles_dilated (px, one texel per
// 16x16 px), half_specular (luminance, half resolution, lit scenes only).
// Writes: far_gather (radiance behind the near layer; a: 1 where something was found); where anything is blurred before
// focus near_gather (premultiplied; a: coverage) and, lit, near_specular (luminance, premultiplied); half resolution.
// Over: the tiles of TileWork, a class at a time.
// Method: scatter-as-gather of Jimenez 2014 with two differences. (1) A tap's weight is the part of the sample's splat
// that falls into the tap's ring, exactly, which replaces sample alpha 1/(pi r^2) and its soft comparison: coverage is
// right for every CoC under one kernel. (2) A sample shows with the CoC of the nearer of itself and the receiving
// texel, which draws the silhouette between them (lib/splat.glsl).
// A class of tiles (tile_classes.glsl) has a kernel with the layers that they can have: NEAR_LAYER, FAR_LAYER.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "dof/tile_classes.glsl"
#include "dof/listed_tile.glsl"
#include "dof/taps.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_prefiltered;
uniform sampler2D in_tiles_dilated;
layout(rgba16f) uniform writeonly image2D out_far_gather;
#if HAS_NEAR_GATHER
layout(rgba16f) uniform writeonly image2D out_near_gather;
#endif
#if HAS_NEAR_SPECULAR
uniform sampler2D in_half_specular;
layout(r16f) uniform writeonly image2D out_near_specular;
#endif

ivec2 last;  // index of the last texel

// Drawing at half resolution is itself a blur: the 2x2 mean and the nearest texel of a tap add a variance of 1/3 px^2
// each, bilinear upsampling 2/3, along each axis. The splat shrinks until the sum is the variance of what the prefilter
// left to draw, but to no less than half its radius. Squared radius [px^2].
const float HALF_RES_VARIANCE_PX2 = 4.0 / 3.0;
float splat_px2(float radius, Opening opening) {
    return shrunk_px2(radius, HALF_RES_VARIANCE_PX2, opening.spread);
}

// The texel that a tap samples, `side` 1 in front of focus, where light crosses over in the lens, and -1 behind. The
// kernel of a CoC `reach` [px] is smaller, of `radius` px, about the middle of what is open of the lens.
ivec2 tap_texel(ivec2 texel, Tap tap, float side, float reach, float radius, Opening opening) {
    vec2 offset_px = radius * tap.point + (reach - radius) * opening.middle;
    return clamp(ivec2(floor(vec2(texel) + 0.5 + 0.5 * side * offset_px)), ivec2(0), last);
}

struct Near {
    vec4 layer;      // premultiplied; a: coverage
    float specular;  // luminance, premultiplied
    vec4 behind;     // weighted sum of what lies behind the layer; a: weight
};

// What is in front of focus within `radius` px, and what it lets through. The kernel is mirrored: near light crosses
// over in the lens.
Near gather_near(ivec2 texel, vec4 own, float nearest, int n, Opening opening) {
    vec4 fore = vec4(0.0), middle = vec4(0.0), behind = vec4(0.0);
    vec2 specular = vec2(0.0);
    float radius = kernel_px(splat_px2(nearest, opening), n, opening);
    for (int k = 0; k <= n; k++) {
        Ring ring = ring_at(turned_kernel(n), k, radius, opening);
        // What a near surface hides is best guessed from what shows closest by: a weight that falls steeply, and so
        // faint that it counts only where no sample's own blur reaches.
        float guess = 1e-3 / (float(k * k * k * k) + 1.0);
        for (int i = ring.first; i < ring.end; i++) {
            Tap place = tap_at(i, ring, opening);
            ivec2 there = tap_texel(texel, place, 1.0, -nearest, radius, opening);
            vec4 tap = fetch_sample(in_prefiltered, there);
            float share = near_layer_share(tap.a), front = fore_share(tap.a, nearest, frame.layer_fade_px);
            float light = share * tap_light(splat_px2(silhouette_px(own.a, tap.a), opening), ring, place, opening);
            vec4 color = vec4(tap.rgb, 1.0);
            fore += light * front * color;
            middle += light * (1.0 - front) * color;
            behind += (1.0 - share) * (tap_light(splat_px2(tap.a, opening), ring, place, opening) + guess) * color;
#if HAS_NEAR_SPECULAR
            specular += light * vec2(front, 1.0 - front) * fetch_light(in_half_specular, there).r;
#endif
        }
    }
    vec4 layer = stacked(fore, middle);
    return Near(layer, stacked(vec4(vec3(specular.x), fore.a), vec4(vec3(specular.y), middle.a)).r, behind);
}

// The picture behind the near layer at a texel behind focus: surfaces nearer than its own cover their share of it, the
// rest shows through.
vec4 gather_far(ivec2 texel, vec4 own, int n, Opening opening) {
    vec4 fore = vec4(0.0), rest = vec4(0.0);
    float radius = kernel_px(splat_px2(own.a, opening), n, opening);
    for (int k = 0; k <= n; k++) {
        Ring ring = ring_at(turned_kernel(n), k, radius, opening);
        for (int i = ring.first; i < ring.end; i++) {
            Tap place = tap_at(i, ring, opening);
            vec4 tap = fetch_sample(in_prefiltered, tap_texel(texel, place, -1.0, own.a, radius, opening));
            float light = tap_light(splat_px2(silhouette_px(own.a, tap.a), opening), ring, place, opening);
            light *= 1.0 - near_layer_share(tap.a);
            float front = fore_share(tap.a, own.a - frame.layer_fade_px, frame.layer_fade_px);
            fore += light * front * vec4(tap.rgb, 1.0);
            rest += light * (1.0 - front) * vec4(tap.rgb, 1.0);
        }
    }
    return stacked(fore, rest / max(rest.a, 1e-6));
}

void main() {
    ivec2 tile = listed_tile(), texel = texel_of(tile, 8);
    last = imageSize(out_far_gather) - 1;
    if (tile.x < 0 || any(greaterThan(texel, last))) return;
    vec4 own = fetch_sample(in_prefiltered, texel);
    Near near = Near(vec4(0.0), 0.0, vec4(0.0));
    vec4 behind = vec4(own.rgb, 1.0);
#if NEAR_LAYER || FAR_LAYER
    vec2 reach = fetch_finite(in_tiles_dilated, tile).xy;
    Opening opening = opening_at(2.0 * (vec2(texel) + 0.5));
#endif
#if NEAR_LAYER
    float nearest = min(reach.x, 0.0);
    near = gather_near(texel, own, nearest, ring_count(-0.5 * nearest, RINGS), opening);
    if (near_layer_share(own.a) > 0.0) behind = near.behind;
#endif
#if FAR_LAYER
    if (own.a > HALF_RES_BEGIN_PX) behind = gather_far(texel, own, ring_count(0.5 * reach.y, RINGS), opening);
#endif
#if HAS_NEAR_GATHER
    imageStore(out_near_gather, texel, near.layer);
#endif
    imageStore(out_far_gather, texel, behind.a > 0.0 ? vec4(behind.rgb / behind.a, 1.0) : vec4(own.rgb, 0.0));
#if HAS_NEAR_SPECULAR
    imageStore(out_near_specular, texel, vec4(near.specular));
#endif
}
