// Where the rasterised sample of a pixel lies: the pinhole's ray, or in the raster reference the ray from the frame's
// lens point through the point where the pinhole's ray meets the focal plane.
#include "shared/frame.glsl"

// The camera's slope (right, up per metre of planar depth) of the pinhole ray through a point of the image [px].
vec2 pinhole_slope(vec2 image_px) {
    float aspect = frame.size_px.x * frame.inverse_size.y;
    return (2.0 * image_px * frame.inverse_size - 1.0) * frame.tan_half_fov_y * vec2(aspect, 1.0);
}

// The same from this frame's lens point, in camera axes: through the focal plane's point slope * d, starting at the
// lens offset.
vec2 lens_offset() {
    return (frame.view * vec4(frame.lens_eye, 1.0)).xy;
}

// Position in camera axes (right, up, forward) [m] of what lies at planar depth z [m] in the sample at image_px.
vec3 sample_in_camera(vec2 image_px, float z) {
    vec2 offset = lens_offset();
    return vec3(offset + (pinhole_slope(image_px) - offset * frame.inverse_focus) * z, z);
}

vec3 camera_to_world(vec3 p) {
    return (frame.view_to_world * vec4(p.xy, -p.z, 1.0)).xyz;
}

// Width of one pixel [m] at planar depth z [m].
float pixel_footprint(float z) {
    return z * 2.0 * frame.tan_half_fov_y * frame.inverse_size.y;
}
