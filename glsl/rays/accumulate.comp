// Adds this frame's rays to the near and the far layer, each fetched from where its own surfaces were last frame.
// Reads: trace_near, trace_far (premultiplied; a: share of rays), trace_motion (px), trace_coc (px; near, far),
//   trace_moments (compressed luminance and its square, of the near and the far part), ray_count (x: rays), mask (x:
//   weight in the budget); last frame's layers.
// Writes: near_layer, far_layer (accumulated, premultiplied; a: share of rays), layer_state (x: rays in the near
//   mean, y: in the far mean; z: hit ratio; w: 1 where the layers hold anything), layer_coc, layer_moments (trace_coc and
//   trace_moments, accumulated), near_light, far_light (what the composite lays: premultiplied; a: share), half resolution.
// Method: poster, 2.2: exponential moving average with reprojection per layer (Lehtinen et al. 2011); a still camera
// takes the plain mean. Both layers move by the mean screen motion of their own hits, or of their neighbours' where
// no ray hit that layer. Motion composes by the accumulated ratio only as far as the latest rays bear it out. While
// the camera is still and temporal anti-aliasing averages whole frames (AVERAGED), a frame shows its own rays only: a
// mean of running means would count the first rays again in every frame.
#include "shared/frame.glsl"
#include "lib/hit_layers.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_trace_near;
uniform sampler2D in_trace_far;
uniform sampler2D in_trace_motion;
uniform sampler2D in_trace_coc;
uniform sampler2D in_trace_moments;
uniform sampler2D in_ray_count;
uniform sampler2D in_mask;
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

// This frame's rays around a pixel.
struct Around {
    vec4 motion;  // px; xy near, zw far; of 5x5 pixels at most
    float ratio;  // hit ratio of 3x3 pixels ...
    float rays;   // ... from this many rays
};

// Last frame's mean at a continuous half-res position: bilinear among the texels that hold one, nothing off screen.
// `field`: 0 near, 1 far.
Mean earlier(sampler2D layer, int field, vec2 position) {
    ivec2 size = textureSize(layer, 0);
    if (any(lessThan(position, vec2(0.0))) || any(greaterThan(position, vec2(size)))) return NOTHING;
    ivec2 corner = ivec2(floor(position - 0.5));
    vec2 f = position - 0.5 - vec2(corner);
    Mean sum = NOTHING;
    float weight = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 step = ivec2(i & 1, i >> 1), texel = clamp(corner + step, ivec2(0), size - 1);
        float held = texelFetch(prev_layer_state, texel, 0)[field];
        vec2 bilinear = mix(1.0 - f, f, vec2(step));
        float w = held > 0.0 ? bilinear.x * bilinear.y : 0.0;
        vec4 light = texelFetch(layer, texel, 0), moments = texelFetch(prev_layer_moments, texel, 0);
        sum.layer += w * light;
        sum.circle += w * light.a * texelFetch(prev_layer_coc, texel, 0)[field];
        sum.moments += w * (field == 0 ? moments.xy : moments.zw);
        sum.rays += w * held;
        weight += w;
    }
    if (weight == 0.0) return NOTHING;
    return Mean(sum.layer / weight, sum.circle / weight, sum.moments / weight, sum.rays / weight);
}

Around look_around(ivec2 p) {
    ivec2 last = textureSize(in_mask, 0) - 1;
    vec4 motion = vec4(0.0), shares = vec4(0.0);
    vec2 hits = vec2(0.0);
    for (int i = 0; i < 25; i++) {
        ivec2 offset = ivec2(i % 5, i / 5) - 2, texel = clamp(p + offset, ivec2(0), last);
        float rays = texelFetch(in_ray_count, texel, 0).x;
        if (rays == 0.0) continue;
        vec4 share = rays * vec4(texelFetch(in_trace_near, texel, 0).aa, texelFetch(in_trace_far, texel, 0).aa);
        // The pixel's own hits decide how its layers move; its neighbours' count where it has none.
        float say = offset == ivec2(0) ? 1.0 : 1e-4;
        motion += say * share * texelFetch(in_trace_motion, texel, 0);
        shares += say * share;
        if (max(abs(offset.x), abs(offset.y)) < 2) hits += vec2(share.x, rays);
    }
    motion /= max(shares, 1e-12);
    if (shares.x == 0.0) motion.xy = motion.zw;  // no near hit anywhere: an empty layer may move with the other
    if (shares.z == 0.0) motion.zw = motion.xy;
    return Around(motion, hits.x / max(hits.y, 1.0), hits.y);
}

void add(inout Mean mean, Mean newest, float floor_weight) {
    float weight = newest_weight(newest.rays, mean.rays, floor_weight);
    if (weight == 0.0) return;
    mean.layer = mix(mean.layer, newest.layer, weight);
    mean.circle = mix(mean.circle, newest.circle, weight);
    mean.moments = mix(mean.moments, newest.moments, weight);
    mean.rays = newest.rays / weight;
}

// Scales a layer's accumulated light to the share it is composed with.
vec4 composed(vec4 layer, float share) {
    return layer.a > 0.0 ? vec4(layer.rgb / layer.a, 1.0) * share : vec4(0.0);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(out_near_layer)))) return;
    Mean near = NOTHING, far = NOTHING;
    vec4 near_light = vec4(0.0), far_light = vec4(0.0);
    float ratio = 0.0;
    if (texelFetch(in_mask, p, 0).x > 0.0) {
        bool moved = frame.moved != 0u;
        Around around = moved ? look_around(p) : Around(vec4(0.0), 0.0, 0.0);
        if (frame.history_valid != 0u) {
            near = earlier(prev_near_layer, 0, vec2(p) + 0.5 - 0.5 * around.motion.xy);
            far = earlier(prev_far_layer, 1, vec2(p) + 0.5 - 0.5 * around.motion.zw);
        }
        float rays = texelFetch(in_ray_count, p, 0).x;
        Mean near_now = NOTHING, far_now = NOTHING;
        if (rays > 0.0) {
            vec4 near_layer = texelFetch(in_trace_near, p, 0), far_layer = texelFetch(in_trace_far, p, 0);
            vec4 moments = texelFetch(in_trace_moments, p, 0);
            vec2 circle = texelFetch(in_trace_coc, p, 0).xy * vec2(near_layer.a, far_layer.a);
            near_now = Mean(near_layer, circle.x, moments.xy, rays);
            far_now = Mean(far_layer, circle.y, moments.zw, rays);
        }
        float floor_weight = moved ? frame.history_alpha : 0.0;
        add(near, near_now, floor_weight);
        add(far, far_now, floor_weight);
        ratio = near.layer.a;  // it moved with the edge; what the far layer had left open did not
        if (moved) ratio = trusted_ratio(ratio, around.ratio, around.rays);
        bool own_rays = AVERAGED == 1 && !moved && rays > 0.0;
        near_light = own_rays ? near_now.layer : composed(near.layer, ratio);
        far_light = own_rays ? far_now.layer : composed(far.layer, 1.0 - ratio);
    }
    imageStore(out_near_layer, p, near.layer);
    imageStore(out_far_layer, p, far.layer);
    imageStore(out_layer_state, p, vec4(near.rays, far.rays, ratio, float(min(near.rays, far.rays) > 0.0)));
    vec2 circle = vec2(near.circle, far.circle) / max(vec2(near.layer.a, far.layer.a), 1e-6);
    imageStore(out_layer_coc, p, vec4(circle, 0.0, 0.0));
    imageStore(out_layer_moments, p, vec4(near.moments, far.moments));
    imageStore(out_near_light, p, near_light);
    imageStore(out_far_light, p, far_light);
}
