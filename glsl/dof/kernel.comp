// Lays out the aperture for the passes that gather over it: every kernel they may choose, once a frame.
// Reads: the lens' shape and the frame's index.
// Writes: kernel (xy: points of the aperture, half lens diameters). Row n holds the kernel of n rings as this frame
//   turns it, row UNTURNED + n as frame 0 does; row 0 the points of the rim.
// Method: lib/kernel.glsl. A tap is the same for every pixel, so it is a constant of the frame, not of the work group.
#include "shared/frame.glsl"
#include "lib/kernel.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(rg32f) uniform writeonly image2D out_kernel;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(out_kernel)))) return;
    int n = p.y % UNTURNED;
    uint index_of_frame = p.y < UNTURNED ? frame.frame_index : 0u;
    vec2 point = vec2(0.0);
    if (n > 0 && p.x < kernel_taps(n)) {
        point = kernel_tap(p.x, n, index_of_frame, BLADES, frame.lens_rotation, frame.lens_anamorphic);
    } else if (n == 0 && p.x < RIM_POINTS) {
        float turn = (float(p.x) + 0.5) / float(RIM_POINTS);
        point = aperture_point(turn, 1.0, BLADES, frame.lens_rotation, frame.lens_anamorphic);
    }
    imageStore(out_kernel, p, vec4(point, 0.0, 0.0));
}
