// Adds up each row of a picture of sums.
// Reads: sums (measure/block_sums.comp).
// Writes: rows (one texel wide, one a row of sums, in the same units).
// Method: one invocation a row; what is left is small enough for the processor to add in float64.

layout(local_size_x = 1, local_size_y = 64) in;
uniform sampler2D in_sums;
layout(rgba32f) uniform writeonly image2D out_rows;

void main() {
    int row = int(gl_GlobalInvocationID.y);
    if (row >= imageSize(out_rows).y) return;
    vec4 sum = vec4(0.0);
    for (int x = 0; x < textureSize(in_sums, 0).x; ++x) sum += texelFetch(in_sums, ivec2(x, row), 0);
    imageStore(out_rows, ivec2(0, row), sum);
}
