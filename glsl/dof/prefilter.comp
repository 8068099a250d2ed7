// Blurs each sample over the area that one tap of the gather stands for, so that the few taps miss nothing between them.
// Reads: half_color (radiance; a: signed CoC, full-res px). Writes: prefiltered (the same, filtered). Both half resolution.
// Method: bilateral prefilter of Jimenez 2014: a ring of taps about the texel, kept to its own surface by CoC. Its radius follows from the kernel:
// a disc with the area of one tap. Where the gather's rings are a texel apart anyway nothing is filtered.
#include "shared/frame.glsl"
#include "lib/kernel.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_half_color;
layout(rgba16f) uniform writeonly image2D out_prefiltered;

const int PREFILTER_RINGS = 2;  // fills the area of one tap without gaps up to a spacing of 5 texels, a CoC of 45 px with 4 rings
const int PREFILTER_TAPS = 1 + 4 * PREFILTER_RINGS * (PREFILTER_RINGS + 1);
const float OVERLAP = 1.8;  // radius of the filter against half the spacing: discs that just touch would leave gaps between them
shared vec2 taps[PREFILTER_TAPS];

void main() {
    int lane = int(gl_LocalInvocationIndex);
    if (lane < PREFILTER_TAPS) taps[lane] = kernel_tap(lane, PREFILTER_RINGS, 0u, BLADES, frame.lens_rotation, frame.lens_anamorphic);
    barrier();
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), last = imageSize(out_prefiltered) - 1;
    if (any(greaterThan(texel, last))) return;
    vec4 own = texelFetch(in_half_color, texel, 0);
    float spacing_half = 0.5 * abs(own.a) / (float(RINGS) + 0.5);
    vec3 sum = own.rgb;
    float weight = 1.0;
    if (spacing_half > 1.0) {
        for (int i = 1; i < PREFILTER_TAPS; i++) {
            vec2 position = vec2(texel) + 0.5 + 0.5 * OVERLAP * spacing_half * taps[i];
            vec4 tap = textureLod(in_half_color, position / vec2(last + 1), 0.0);
            float same = 1.0 - smoothstep(0.0, 1.0, abs(tap.a - own.a) / frame.layer_fade_px);
            sum += same * tap.rgb;
            weight += same;
        }
    }
    imageStore(out_prefiltered, texel, vec4(sum / weight, own.a));
}
