// The ray that a lens point sends through a pixel (thin lens; Cook, Porter and Carpenter 1984).
#include "shared/primary.glsl"
#include "lib/lens.glsl"
#include "lib/intersect.glsl"

// `pixel_px` in continuous pixel coordinates, `lens` in the unit square. The direction has view depth 1, so that t *is*
// planar depth.
Ray lens_ray(vec2 pixel_px, vec2 lens) {
    vec2 point = lens_point(lens, BLADES, frame.lens_rotation, frame.lens_anamorphic, frame.lens_aberration);
    vec2 offset = 0.5 * frame.aperture * point;
    vec3 direction = vec3(pinhole_slope(pixel_px) - offset * frame.inverse_focus, -1.0);
    vec3 origin = (frame.view_to_world * vec4(offset, 0.0, 1.0)).xyz;
    return Ray(origin, mat3(frame.view_to_world) * direction, frame.near_plane);
}
