// The ray that a lens point sends through a pixel (thin lens; Cook, Porter and Carpenter 1984).
#include "shared/primary.glsl"
#include "lib/lens.glsl"
#include "lib/sampling.glsl"
#include "lib/intersect.glsl"

// Points of the lens tried for one ray. The barrel leaves 39 % of a disc open at its narrowest, a tenth of the oddest
// aperture: then one ray in a thousand counts though it should have been blocked.
const uint MOST_TRIES = 64u;

// Point of the aperture [half lens diameters] for a point of the unit square.
vec2 aperture_sample(vec2 square) {
    return lens_point(square, BLADES, frame.lens_rotation, frame.lens_anamorphic, frame.lens_aberration);
}

// Whether the barrel lets the ray through `pixel_px` from the point `square` of the unit square pass.
bool open_lens(vec2 pixel_px, vec2 square) {
#if CAT_EYE
    return passes_barrel(aperture_sample(square), barrel_shift(pixel_px, frame.size_px, frame.lens_cat_eye));
#else
    return true;
#endif
}

// Where in the unit square the ray of sample `index` takes its lens point: `square`, that sample's own, or if the
// barrel blocks it the first that passes of points elsewhere in the sequence, so that a pixel of few rays loses none of
// them. They are picked at random: the same sample under another scramble would lie where the first one determines, and
// no number of rays would fill the open lens evenly.
vec2 lens_sample(vec2 pixel_px, vec2 square, uint index, uint seed) {
    for (uint i = 1u; i < MOST_TRIES && !open_lens(pixel_px, square); i++) {
        square = sobol4(hash_u32(index * MOST_TRIES + i), seed).xy;
    }
    return square;
}

// `pixel_px` in continuous pixel coordinates, `lens` in the unit square. The direction has view depth 1, so that t *is*
// planar depth.
Ray lens_ray(vec2 pixel_px, vec2 lens) {
    vec2 offset = 0.5 * frame.aperture * aperture_sample(lens);
    vec3 direction = vec3(pinhole_slope(pixel_px) - offset * frame.inverse_focus, -1.0);
    vec3 origin = (frame.view_to_world * vec4(offset, 0.0, 1.0)).xyz;
    return Ray(origin, mat3(frame.view_to_world) * direction, frame.near_plane);
}
