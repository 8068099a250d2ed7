// Adds one frame to a running mean that neither drifts nor stalls.
// Reads: color (radiance of this frame, full resolution).
// Writes (updated in place, full resolution): reference (mean radiance; a: number of frames that count),
//   reference_error (what rounding has so far withheld from the mean).
// Method: mean += (x - mean) / n with compensated addition (Kahan 1965): past thousands of frames the update is smaller
// than half an ulp of the mean and would be lost. A frame does not count at pixels for which the lens' barrel blocks
// its lens point.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/lens.glsl"
#include "lib/running_mean.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D in_color;
layout(rgba32f) uniform image2D out_reference;
layout(rgba32f) uniform image2D out_reference_error;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, ivec2(frame.size_px)))) return;
    vec4 mean = imageLoad(out_reference, p);
    vec3 withheld = imageLoad(out_reference_error, p).rgb;
    float points = mean.a;
#if CAT_EYE
    vec2 image_px = vec2(p) + 0.5 + frame.jitter_px;
    bool counts = passes_barrel(frame.lens_point, barrel_shift(image_px, frame.size_px, frame.lens_cat_eye));
#else
    bool counts = true;
#endif
    // Before any point counts, what it sees stands in for the mean: the first that counts replaces it wholly.
    if (counts || points == 0.0) add_sample(mean, withheld, fetch_light(in_color, p).rgb);
    if (!counts) mean.a = points;
    imageStore(out_reference, p, mean);
    imageStore(out_reference_error, p, vec4(withheld, 0.0));
}
