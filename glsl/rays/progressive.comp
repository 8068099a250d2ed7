// The ray-traced view: adds lens samples to every pixel's running mean.
// Reads: the scene and its ray-tracing tree.
// Writes (updated in place, full resolution): traced (mean radiance, linear; a: number of samples), traced_error (what
//   rounding has so far withheld from the mean; a: points of the sequence used up).
// Method: distribution ray tracing over lens and pixel (Cook, Porter and Carpenter 1984) with Owen-scrambled Sobol
// points; the mean is kept in float32 with compensated addition. Rows slice_begin to slice_end only, so that one frame
// never takes long.
#include "shared/frame.glsl"
#include "lib/sampling.glsl"
#include "lib/running_mean.glsl"
#include "rays/lens_ray.glsl"
#include "rays/hit.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(rgba32f) uniform image2D out_traced;
layout(rgba32f) uniform image2D out_traced_error;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, int(frame.slice_begin));
    if (p.x >= int(frame.size_px.x) || p.y >= int(frame.slice_end)) return;
    vec4 mean = imageLoad(out_traced, p);
    vec4 error = imageLoad(out_traced_error, p);
    vec3 withheld = error.rgb;
    uint index = uint(error.a), seed = pixel_seed(uvec2(p), frame.seed);
    for (uint i = 0u; i < frame.samples_per_frame; ++i) {
        vec4 s = sobol4(index++, seed);
        // What the barrel blocks is passed over: the rest of the sequence is as evenly spread over the open lens.
        for (uint t = 1u; t < MOST_TRIES && !open_lens(vec2(p) + s.zw, s.xy); ++t) s = sobol4(index++, seed);
        float depth;
        vec3 position;
        uint object;
        vec4 color = radiance(lens_ray(vec2(p) + s.zw, s.xy), depth, position, object);
        add_sample(mean, withheld, color.rgb);
    }
    imageStore(out_traced, p, mean);
    imageStore(out_traced_error, p, vec4(withheld, index));
}
