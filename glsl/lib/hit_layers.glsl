// The two layers of traced light and how they are put together. Float64 twins: tests/gpu/hybrid_twin.py.
#include "lib/mask.glsl"

// How far outside the CoCs around a pixel the history's may lie: a pixel of blur is below what shows, and what a mean
// of few hits misses of a sloping surface grows with the blur.
const float SAME_DEPTH_PX = 1.0;
const float SAME_DEPTH_SHARE = 0.1;

// Part of a hit that belongs to the near layer: none within the focus zone, all `blend` px of CoC in front of it
// (poster, 2.1).
float near_share(float coc, float in_focus_px, float blend) {
    return smoothstep(0.0, 1.0, (-coc - in_focus_px) / blend);
}

// Part of what lies behind the near layer that the full-resolution raster path shows better than any half-res layer:
// all of it in focus and slightly out of it, none once it is blurred or itself in the near layer.
float raster_share(float coc, float in_focus_px, float blend) {
    float full_res = 1.0 - smoothstep(RAYS_BEGIN_PX, RAYS_END_PX, abs(coc));
    return full_res * (1.0 - near_share(coc, in_focus_px, blend));
}

// Part of the far layer that the post-process provides: where nearly all rays hit near, few are left for the far
// layer (poster, 2.3).
float post_far_share(float hit_ratio, float threshold) {
    return threshold < 1.0 ? smoothstep(threshold, 1.0, hit_ratio) : 0.0;
}

// Weight of the post-process where it is bright with specular near bokeh, in which rays are noisiest (poster, 2.3).
float post_near_share(float specular, float threshold) {
    return smoothstep(threshold, 2.0 * threshold, specular);
}

// Whether history of CoC `coc` may belong to a layer whose CoC now lies between circle.x and circle.y [px]. None may
// where no ray hit the layer, and the range is empty: it would be a ghost.
bool same_depth(float coc, vec2 circle) {
    float margin = SAME_DEPTH_PX + SAME_DEPTH_SHARE * max(abs(circle.x), abs(circle.y));
    return circle.x <= circle.y && coc >= circle.x - margin && coc <= circle.y + margin;
}

// Weight of `rays` new samples against a mean of `before`, never below `floor_weight`.
float newest_weight(float rays, float before, float floor_weight) {
    return rays > 0.0 ? max(rays / (rays + before), floor_weight) : 0.0;
}

// The accumulated hit ratio, kept within twice the standard error of the latest one: what the newest `rays` rays
// contradict is a ghost. The error is that of a proportion with one success and one failure added (Laplace's rule of
// succession), so that it is never zero.
float trusted_ratio(float accumulated, float latest, float rays) {
    float n = rays + 2.0;
    float q = (latest * rays + 1.0) / n;
    float margin = 2.0 * sqrt(q * (1.0 - q) / n);
    return clamp(accumulated, max(q - margin, 0.0), min(q + margin, 1.0));
}
