// The blur of slight defocus, gathered at full resolution, where half resolution would be too soft. Included by
// post.comp only.
// Method: the gather of gather.comp with a kernel of one or two rings (the full-resolution path of Jimenez 2014);
// samples that the half-resolution near layer draws are left to it.
#include "shared/frame.glsl"
#include "lib/kernel.glsl"
#include "dof/layers.glsl"

const float ONE_RING_PX = 2.0;  // radius up to which 8 taps resolve the disc: none is farther than 1.3 px from the next
shared vec2 taps[9 + 25];       // kernels of one ring and of two

// Fills `taps`; the whole work group calls it.
void place_taps() {
    int i = int(gl_LocalInvocationIndex);
    int index = i < 9 ? i : i - 9, n = i < 9 ? 1 : 2;
    if (i < 34) taps[i] = kernel_tap(index, n, frame.frame_index, BLADES, frame.lens_rotation, frame.lens_anamorphic);
    barrier();
}

// The nearest pixel of a tap blurs by a variance of 1/12 px^2, which the splat gives up, as in gather.comp. Squared
// radius [px^2].
float sharper_px2(float radius) {
    return max(radius * radius - 4.0 / 12.0, 0.25 * radius * radius);
}

// Radiance at `pixel` of CoC `own` [px], from a kernel of `radius` px.
vec3 slight_focus(sampler2D radiance, sampler2D circle, ivec2 pixel, float own, float radius) {
    float side = own > 0.0 ? 1.0 : -1.0;
    int n = radius <= ONE_RING_PX ? 1 : 2, kernel = n == 1 ? 0 : 9;
    ivec2 last = textureSize(circle, 0) - 1;
    radius = sqrt(sharper_px2(radius));
    vec4 sum = vec4(0.0);
    for (int k = 0; k <= n; k++) {
        float inner = k == 0 ? 0.0 : radius * ring_rim(k - 1, n), outer = radius * ring_rim(k, n);
        int first = first_tap(k), count = ring_taps(k);
        for (int i = first; i < first + count; i++) {
            // Only the own pixel's side of focus has its kernel's orientation right; within 4 px the other side's
            // mirror image is not told apart.
            ivec2 there = clamp(ivec2(floor(vec2(pixel) + 0.5 - side * radius * taps[kernel + i])), ivec2(0), last);
            float coc = gathered_coc(texelFetch(circle, there, 0).r, frame.max_coc_px);
            float splat = sharper_px2(silhouette_px(own, coc));
            float light = ring_light(inner * inner, outer * outer, splat, frame.lens_aberration) / float(count);
            light *= 1.0 - near_layer_share(coc);
            sum += light * vec4(finite_radiance(texelFetch(radiance, there, 0)).rgb, 1.0);
        }
    }
    return sum.rgb / max(sum.a, 1e-6);
}
