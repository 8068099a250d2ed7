// Sums a picture's squared errors over blocks of BLOCK x BLOCK pixels, apart for each of REGIONS regions.
// Reads: picture (linear radiance, full resolution), truth (rgb: true linear radiance; a: the pixel's region 0, 1, ...;
//   full resolution).
// Writes: sums (one texel a block; the regions' pictures of blocks lie one above the other), x: squared error,
//   y: relative squared error, z: displayed squared error (lib/errors.glsl), w: pixels.
// Method: one invocation a block, which texelFetch serves from the texture cache; a sum of a few hundred terms, none
// negative, keeps its digits in float32: each addition errs by at most 2^-24 of the sum.
#include "lib/errors.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_picture;
uniform sampler2D in_truth;
layout(rgba32f) uniform writeonly image2D out_sums;

void main() {
    ivec2 block = ivec2(gl_GlobalInvocationID.xy), blocks = ivec2(imageSize(out_sums)) / ivec2(1, REGIONS);
    if (any(greaterThanEqual(block, blocks))) return;
    ivec2 begin = block * BLOCK, end = min(begin + BLOCK, textureSize(in_truth, 0));
    vec4 sums[REGIONS];
    for (int region = 0; region < REGIONS; ++region) sums[region] = vec4(0.0);
    for (int y = begin.y; y < end.y; ++y) {
        for (int x = begin.x; x < end.x; ++x) {
            vec4 truth = texelFetch(in_truth, ivec2(x, y), 0);
            vec4 errors = vec4(squared_errors(texelFetch(in_picture, ivec2(x, y), 0).rgb, truth.rgb), 1.0);
            // Chosen, not multiplied by 0: what is not a number must not spread to the other regions.
            for (int region = 0; region < REGIONS; ++region) {
                sums[region] += int(truth.a) == region ? errors : vec4(0.0);
            }
        }
    }
    for (int region = 0; region < REGIONS; ++region) {
        imageStore(out_sums, ivec2(block.x, region * blocks.y + block.y), sums[region]);
    }
}
