// Paints where a picture is wrong; a pixel that is not a number or infinite is magenta.
// Reads: picture (linear radiance, full resolution), truth (rgb: true linear radiance, full resolution), range
//   (ends of the colour map, displayed difference 0..1).
// Writes: display (full resolution, display values).
// Method: root mean square difference of the displayed channels (lib/errors.glsl), in the colours of lib/colormap.glsl.
#include "lib/colormap.glsl"
#include "lib/errors.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_picture;
uniform sampler2D in_truth;
uniform vec2 range;
layout(rgba8) uniform writeonly image2D out_display;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(out_display)))) return;
    vec3 light = texelFetch(in_picture, pixel, 0).rgb;
    float error = sqrt(squared_errors(light, texelFetch(in_truth, pixel, 0).rgb).z);
    bool valid = !(any(isnan(light)) || any(isinf(light)));
    vec3 color = sequential((error - range.x) / max(range.y - range.x, 1e-30));
    imageStore(out_display, pixel, vec4(valid ? color : INVALID, 1.0));
}
