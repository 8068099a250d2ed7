// The blur of slight defocus, gathered at full resolution, where half resolution would be too soft. Included by
// post.comp only.
// Method: the gather of gather.comp with a kernel of one or two rings (the full-resolution path of Jimenez 2014);
// samples that the half-resolution near layer draws are left to it.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "dof/layers.glsl"
#include "dof/taps.glsl"

const float ONE_RING_PX = 2.0;  // radius up to which 8 taps resolve the disc: none is farther than 1.3 px from the next

// The nearest pixel of a tap blurs by this variance [px^2] along each axis, which the splat gives up, as in
// gather.comp.
const float NEAREST_VARIANCE_PX2 = 1.0 / 12.0;

// Radiance at `pixel` of CoC `own` [px], from a kernel of `radius` px.
vec3 slight_focus(sampler2D radiance, sampler2D circle, ivec2 pixel, float own, float radius) {
    float side = own > 0.0 ? 1.0 : -1.0;
    int n = radius <= ONE_RING_PX ? 1 : 2;
    ivec2 last = textureSize(circle, 0) - 1;
    Opening opening = opening_at(vec2(pixel) + 0.5);
    radius = kernel_px(shrunk_px2(radius, NEAREST_VARIANCE_PX2, opening.spread), n, opening);
    vec4 sum = vec4(0.0);
    for (int k = 0; k <= n; k++) {
        Ring ring = ring_at(turned_kernel(n), k, radius, opening);
        for (int i = ring.first; i < ring.end; i++) {
            // Only the own pixel's side of focus has its kernel's orientation right; within 4 px the other side's
            // mirror image is not told apart.
            Tap tap = tap_at(i, ring, opening);
            ivec2 there = clamp(ivec2(floor(vec2(pixel) + 0.5 - side * radius * tap.point)), ivec2(0), last);
            float coc = gathered_coc(fetch_finite(circle, there).r, frame.max_coc_px);
            float splat = shrunk_px2(silhouette_px(own, coc), NEAREST_VARIANCE_PX2, opening.spread);
            float light = tap_light(splat, ring, tap, opening) * (1.0 - near_layer_share(coc));
            sum += light * vec4(fetch_light(radiance, there).rgb, 1.0);
        }
    }
    return sum.rgb / max(sum.a, 1e-6);
}
