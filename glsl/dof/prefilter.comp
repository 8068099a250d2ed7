// Blurs each sample over the area that one tap of the gather stands for, so that the few taps miss nothing between
// them.
// Reads: half_color (radiance; a: signed CoC, full-res px). Writes: prefiltered (radiance, filtered; a: signed radius
// of the disc that is left for the gather to draw, full-res px). Both half resolution.
// Method: bilateral prefilter of Jimenez 2014: taps about the texel, kept to its own surface by CoC, in the shape of
// the open lens. Variances of blurs add, so the filter takes its own from the CoC's, but not on a surface so small that
// it finds no neighbours to mix with: there it spreads nothing.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "dof/spacing.glsl"
#include "dof/taps.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_half_color;
layout(rgba16f) uniform writeonly image2D out_prefiltered;

const float FINE_RADIUS_HALF = 3.5;  // radius up to which two rings leave no gap
const float ISOLATED = 0.5;  // part of the filter on its own surface: half on a straight edge, less on what is small

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), last = imageSize(out_prefiltered) - 1;
    if (any(greaterThan(texel, last))) return;
    vec4 own = fetch_sample(in_half_color, texel);
    float radius = prefilter_px(own.a), side = own.a < 0.0 ? 1.0 : -1.0;
    if (radius == 0.0) {
        imageStore(out_prefiltered, texel, own);
        return;
    }
    int n = 0.5 * radius <= FINE_RADIUS_HALF ? 2 : RINGS;
    Opening opening = opening_at(2.0 * (vec2(texel) + 0.5));
    vec3 sum = own.rgb;
    float weight = 1.0, all = 1.0;
    for (int k = 1; k <= n; k++) {
        Ring ring = ring_at(still_kernel(n), k, radius, opening);
        for (int i = ring.first; i < ring.end; i++) {
            Tap place = tap_at(i, ring, opening);
            vec2 offset_px = radius * (place.point - opening.middle);
            // The nearest texel: a mean of two surfaces' CoC would be a third surface's.
            ivec2 there = clamp(ivec2(floor(vec2(texel) + 0.5 + 0.5 * side * offset_px)), ivec2(0), last);
            vec4 tap = fetch_sample(in_half_color, there);
            float part = place.weight.x * float(ring.end - ring.first);
            float same = part * (1.0 - smoothstep(0.0, 1.0, abs(tap.a - own.a) / frame.layer_fade_px));
            sum += same * tap.rgb;
            weight += same;
            all += part;
        }
    }
    float spread = radius * smoothstep(ISOLATED, 1.0, weight / all);
    float left = sqrt(own.a * own.a - spread * spread);  // the filter's radius is a small part of the CoC's
    imageStore(out_prefiltered, texel, vec4(sum / weight, -side * left));
}
