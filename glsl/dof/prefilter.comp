// Blurs each sample over the area that one tap of the gather stands for, so that the few taps miss nothing between
// them.
// Reads: half_color (radiance; a: signed CoC, full-res px). Writes: prefiltered (the same, filtered). Both half
// resolution.
// Method: bilateral prefilter of Jimenez 2014: taps about the texel, kept to its own surface by CoC, in the shape of
// the aperture.
#include "shared/frame.glsl"
#include "lib/kernel.glsl"
#include "dof/spacing.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_half_color;
layout(rgba16f) uniform writeonly image2D out_prefiltered;

const float FINE_RADIUS_HALF = 3.5;  // radius up to which two rings of bilinear taps leave no gap
shared vec2 taps[25 + KERNEL_TAPS];  // a kernel of two rings, and the gather's own

void main() {
    for (int i = int(gl_LocalInvocationIndex); i < 25 + KERNEL_TAPS; i += 64) {
        int n = i < 25 ? 2 : RINGS;
        taps[i] = kernel_tap(i < 25 ? i : i - 25, n, 0u, BLADES, frame.lens_rotation, frame.lens_anamorphic);
    }
    barrier();
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), last = imageSize(out_prefiltered) - 1;
    if (any(greaterThan(texel, last))) return;
    vec4 own = texelFetch(in_half_color, texel, 0);
    float radius_half = 0.5 * prefilter_px(own.a);
    vec3 sum = own.rgb;
    float weight = 1.0;
    if (radius_half > 0.0) {
        bool fine = radius_half <= FINE_RADIUS_HALF;
        int first = fine ? 0 : 25, count = fine ? 25 : KERNEL_TAPS;
        for (int i = first + 1; i < first + count; i++) {
            vec2 position = vec2(texel) + 0.5 + radius_half * taps[i];
            vec4 tap = textureLod(in_half_color, position / vec2(last + 1), 0.0);
            float same = 1.0 - smoothstep(0.0, 1.0, abs(tap.a - own.a) / frame.layer_fade_px);
            sum += same * tap.rgb;
            weight += same;
        }
    }
    imageStore(out_prefiltered, texel, vec4(sum / weight, own.a));
}
