// Adds this frame's rays to the near and the far layer, each fetched from where its own surfaces were last frame.
// Reads: trace_near, trace_far (premultiplied; a: share of rays), trace_motion (px), trace_spread (CoC of near and far
//   hits, px; mean square of their motion, px^2), trace_moments (compressed luminance and its square, of the near and
//   the far part), ray_count (x: rays), mask (x: weight in the budget), gradient (change of near and far light, one
//   texel per 3x3 half-res px) while something moves; last frame's layers.
// Writes: near_layer, far_layer (accumulated, premultiplied; a: share of rays), layer_state (x: rays in the near mean,
//   y: in the far mean; z: hit ratio; w: still frames that they hold, 0: nothing), layer_coc, layer_moments (CoC and
//   moments, accumulated), near_light, far_light (what the composite lays: premultiplied; a: share), half resolution.
// Over: the tiles with rays of RayTiles; elsewhere what it writes is 0.
// Method: poster, 2.2: exponential moving average with reprojection per layer (Lehtinen et al. 2011); a still picture
// takes the plain mean. Both layers move by the mean screen motion of their own hits, or of their neighbours' where no
// ray hit that layer; history that is off screen or lies at another depth is dropped (REJECTION). Motion composes by
// the accumulated ratio only as far as the latest rays bear it out. History is shortened where stored rays changed
// their light (Schied et al. 2018) and where one layer's hits move apart. While nothing moves and temporal
// anti-aliasing averages whole frames (AVERAGED), a frame shows what brings that average to the mean of all rays: after
// n frames n times the mean less n - 1 times the one before. A mean of running means would count the first rays again
// in every frame, and a mean of frames' own means would favour the rays of frames that sent few.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/hit_layers.glsl"
#include "lib/gradient.glsl"
#include "dof/ray_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_trace_near;
uniform sampler2D in_trace_far;
uniform sampler2D in_trace_motion;
uniform sampler2D in_trace_spread;
uniform sampler2D in_trace_moments;
uniform sampler2D in_ray_count;
uniform sampler2D in_mask;
#if HAS_GRADIENT
uniform sampler2D in_gradient;
#endif
uniform sampler2D prev_near_layer;
uniform sampler2D prev_far_layer;
uniform sampler2D prev_layer_state;
uniform sampler2D prev_layer_coc;
uniform sampler2D prev_layer_moments;
layout(rgba32f) uniform writeonly image2D out_near_layer;
layout(rgba32f) uniform writeonly image2D out_far_layer;
layout(rgba32f) uniform writeonly image2D out_layer_state;
layout(rg32f) uniform writeonly image2D out_layer_coc;
layout(rgba32f) uniform writeonly image2D out_layer_moments;
layout(rgba16f) uniform writeonly image2D out_near_light;
layout(rgba16f) uniform writeonly image2D out_far_light;

struct Mean {
    vec4 layer;    // premultiplied; a: share of rays
    float circle;  // CoC times share, px
    vec2 moments;  // compressed luminance and its square, times share
    float rays;    // 0: nothing to go on
};

const Mean NOTHING = Mean(vec4(0.0), 0.0, vec2(0.0), 0.0);

// How far a frame may step from the mean before towards its own rays, in units of the way: a frame of so many times the
// usual rays. Past it a single frame would lie far outside what its rays saw.
const float MOST_STEP = 4.0;

// This frame's rays around a pixel.
struct Around {
    vec4 motion;  // px; xy near, zw far; of 5x5 pixels at most
    vec2 drift;   // px; standard deviation of the motion of the near and of the far hits of 5x5 pixels
    vec4 circle;  // px; smallest and largest CoC of near hits, then of far hits, of 5x5 pixels
    float ratio;  // hit ratio of 3x3 pixels ...
    float rays;   // ... from this many rays
};

const vec4 ANY_CIRCLE = vec4(-1e30, 1e30, -1e30, 1e30), NO_CIRCLE = -ANY_CIRCLE;

// Last frame's mean at a continuous half-res position: bilinear among the texels that hold one, nothing off screen.
// `field`: 0 near, 1 far; `circle`: the CoC that the layer has around here now, px, smallest and largest.
Mean earlier(sampler2D layer, int field, vec2 position, vec2 circle) {
    ivec2 size = textureSize(layer, 0);
    if (any(lessThan(position, vec2(0.0))) || any(greaterThan(position, vec2(size)))) return NOTHING;
    ivec2 corner = ivec2(floor(position - 0.5));
    vec2 f = position - 0.5 - vec2(corner);
    Mean sum = NOTHING;
    float weight = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 step = ivec2(i & 1, i >> 1), texel = clamp(corner + step, ivec2(0), size - 1);
        float held = fetch_finite(prev_layer_state, texel)[field], coc = fetch_finite(prev_layer_coc, texel)[field];
        vec2 bilinear = mix(1.0 - f, f, vec2(step));
        float w = held > 0.0 && same_depth(coc, circle) ? bilinear.x * bilinear.y : 0.0;
        vec4 light = fetch_light(layer, texel), moments = fetch_light(prev_layer_moments, texel);
        sum.layer += w * light;
        sum.circle += w * light.a * coc;
        sum.moments += w * (field == 0 ? moments.xy : moments.zw);
        sum.rays += w * held;
        weight += w;
    }
    if (weight == 0.0) return NOTHING;
    return Mean(sum.layer / weight, sum.circle / weight, sum.moments / weight, sum.rays / weight);
}

Around look_around(ivec2 p) {
    ivec2 last = textureSize(in_mask, 0) - 1;
    vec4 motion = vec4(0.0), shares = vec4(0.0), circle = NO_CIRCLE, mean = vec4(0.0);
    vec2 hits = vec2(0.0), square = vec2(0.0), sum = vec2(1e-12);
    for (int i = 0; i < 25; i++) {
        ivec2 offset = ivec2(i % 5, i / 5) - 2, texel = clamp(p + offset, ivec2(0), last);
        float rays = fetch_finite(in_ray_count, texel).x;
        if (rays == 0.0) continue;
        vec4 share = rays * vec4(fetch_light(in_trace_near, texel).aa, fetch_light(in_trace_far, texel).aa);
        // The pixel's own hits decide how its layers move; its neighbours' count where it has none.
        float say = offset == ivec2(0) ? 1.0 : 1e-4;
        vec4 moved = fetch_finite(in_trace_motion, texel), spread = fetch_finite(in_trace_spread, texel);
        motion += say * share * moved;
        shares += say * share;
        mean += share * moved;
        square += share.xz * spread.zw;
        sum += share.xz;
        if (share.x > 0.0) circle.xy = vec2(min(circle.x, spread.x), max(circle.y, spread.x));
        if (share.z > 0.0) circle.zw = vec2(min(circle.z, spread.y), max(circle.w, spread.y));
        if (max(abs(offset.x), abs(offset.y)) < 2) hits += vec2(share.x, rays);
    }
    motion /= max(shares, 1e-12);
    if (shares.x == 0.0) motion.xy = motion.zw;  // no near hit anywhere: an empty layer may move with the other
    if (shares.z == 0.0) motion.zw = motion.xy;
    mean /= sum.xxyy;
    vec2 drift = sqrt(max(square / sum - vec2(dot(mean.xy, mean.xy), dot(mean.zw, mean.zw)), 0.0));
    return Around(motion, drift, circle, hits.x / max(hits.y, 1.0), hits.y);
}

void add(inout Mean mean, Mean newest, float floor_weight) {
    float weight = newest_weight(newest.rays, mean.rays, floor_weight);
    if (weight == 0.0) return;
    mean.layer = mix(mean.layer, newest.layer, weight);
    mean.circle = mix(mean.circle, newest.circle, weight);
    mean.moments = mix(mean.moments, newest.moments, weight);
    mean.rays = newest.rays / weight;
}

// Change of the near and of the far light around a pixel: the mean over 3x3 stored rays.
vec2 change_around(ivec2 p) {
    vec2 change = vec2(0.0);
#if HAS_GRADIENT
    vec2 known = vec2(0.0);
    ivec2 last = textureSize(in_gradient, 0) - 1;
    for (int i = 0; i < 9; i++) {
        ivec2 block = p / 3 + ivec2(i % 3, i / 3) - 1;
        vec2 here = fetch_finite(in_gradient, clamp(block, ivec2(0), last)).xy, told = step(0.0, here);
        change += told * here;
        known += told;
    }
    change /= max(known, 1.0);
#endif
    return change;
}

// Scales a layer's accumulated light to the share it is composed with.
vec4 composed(vec4 layer, float share) {
    return layer.a > 0.0 ? vec4(layer.rgb / layer.a, 1.0) * share : vec4(0.0);
}

void main() {
    ivec2 tile = listed_tile(), p = texel_of(tile, 8);
    if (tile.x < 0 || any(greaterThanEqual(p, imageSize(out_near_layer)))) return;
    Mean near = NOTHING, far = NOTHING;
    vec4 near_light = vec4(0.0), far_light = vec4(0.0);
    float ratio = 0.0, frames = 0.0;
    if (fetch_light(in_mask, p).x > 0.0) {
        bool moved = frame.moved != 0u;
        Around around = moved ? look_around(p) : Around(vec4(0.0), vec2(0.0), ANY_CIRCLE, 0.0, 0.0);
        if (MOTION == 0) around.motion = vec4(0.0);
        vec4 trusted = REJECTION == 1 ? around.circle : ANY_CIRCLE;
        if (TEMPORAL == 1 && frame.history_valid != 0u) {
            near = earlier(prev_near_layer, 0, vec2(p) + 0.5 - 0.5 * around.motion.xy, trusted.xy);
            far = earlier(prev_far_layer, 1, vec2(p) + 0.5 - 0.5 * around.motion.zw, trusted.zw);
        }
        float rays = fetch_finite(in_ray_count, p).x;
        Mean near_now = NOTHING, far_now = NOTHING;
        if (rays > 0.0) {
            vec4 near_layer = fetch_light(in_trace_near, p), far_layer = fetch_light(in_trace_far, p);
            vec4 moments = fetch_light(in_trace_moments, p);
            vec2 circle = fetch_finite(in_trace_spread, p).xy * vec2(near_layer.a, far_layer.a);
            near_now = Mean(near_layer, circle.x, moments.xy, rays);
            far_now = Mean(far_layer, circle.y, moments.zw, rays);
        }
        vec2 least = vec2(0.0);
        if (moved) {
            vec2 change = change_around(p), drift = REJECTION == 1 ? around.drift : vec2(0.0);
            // The blur around, not the pixel's own: whether its few rays hit a layer must not decide what counts.
            vec4 circle = around.circle;
            least.x = stale_weight(frame.history_alpha, change.x, drift.x, 0.5 * (circle.x + circle.y));
            least.y = stale_weight(frame.history_alpha, change.y, drift.y, 0.5 * (circle.z + circle.w));
        }
        bool fresh = moved || frame.history_valid == 0u || TEMPORAL == 0 || min(near.rays, far.rays) == 0.0;
        frames = fresh ? 1.0 : fetch_finite(prev_layer_state, p).w + 1.0;
        vec4 near_before = near.layer, far_before = far.layer;
        add(near, near_now, least.x);
        add(far, far_now, least.y);
        if (min(near.rays, far.rays) == 0.0) frames = 0.0;
        ratio = near.layer.a;  // it moved with the edge; what the far layer had left open did not
        if (moved && REJECTION == 1) ratio = trusted_ratio(ratio, around.ratio, around.rays);
        bool averaged = AVERAGED == 1 && frames > 1.0;
        float step = min(frames, MOST_STEP * near.rays / max(rays, 1.0));
        near_light = averaged ? mix(near_before, near.layer, step) : composed(near.layer, ratio);
        far_light = averaged ? mix(far_before, far.layer, step) : composed(far.layer, 1.0 - ratio);
    }
    imageStore(out_near_layer, p, near.layer);
    imageStore(out_far_layer, p, far.layer);
    imageStore(out_layer_state, p, vec4(near.rays, far.rays, ratio, frames));
    vec2 circle = vec2(near.circle, far.circle) / max(vec2(near.layer.a, far.layer.a), 1e-6);
    imageStore(out_layer_coc, p, vec4(circle, 0.0, 0.0));
    imageStore(out_layer_moments, p, vec4(near.moments, far.moments));
    imageStore(out_near_light, p, within_half(near_light));
    imageStore(out_far_light, p, within_half(far_light));
}
