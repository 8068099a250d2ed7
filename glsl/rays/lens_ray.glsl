// The ray that a lens point sends through a pixel (thin lens; Cook, Porter and Carpenter 1984).
#include "shared/frame.glsl"
#include "lib/lens.glsl"
#include "lib/intersect.glsl"

// `pixel_px` in continuous pixel coordinates, `lens` in the unit square. The direction has view depth 1, so that t *is* planar depth.
Ray lens_ray(vec2 pixel_px, vec2 lens) {
    vec2 ndc = 2.0 * pixel_px * frame.inverse_size - 1.0;
    vec2 slope = ndc * frame.tan_half_fov_y * vec2(frame.size_px.x * frame.inverse_size.y, 1.0);
    vec2 offset = 0.5 * frame.aperture * lens_point(lens, BLADES, frame.lens_rotation, frame.lens_anamorphic, frame.lens_aberration);
    vec3 direction = vec3(slope - offset * frame.inverse_focus, -1.0);
    vec3 origin = (frame.view_to_world * vec4(offset, 0.0, 1.0)).xyz;
    return Ray(origin, mat3(frame.view_to_world) * direction, frame.near_plane);
}
