// The aperture's sampling, with its brightness profile, and the barrel that narrows it. Float64 twins: app/optics.py.
// blades < 3 is a disc. Points are in units of the lens' half diameter.
#include "lib/pi.glsl"

// Unit square to unit disc, area-preserving and continuous (Shirley and Chiu 1997).
vec2 concentric_disc(vec2 square) {
    vec2 p = 2.0 * square - 1.0;
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    if (radius == 0.0) return vec2(0.0);
    float angle = wide ? (PI / 4.0) * (p.y / p.x) : PI / 2.0 - (PI / 4.0) * (p.x / p.y);
    return radius * vec2(cos(angle), sin(angle));
}

// Enclosed-area fraction t = r^2 with density 1 + s (2t - 1), from uniform u: the quadratic's root in the form that
// does not cancel.
float aberrated_area(float u, float s) {
    return 2.0 * u / max((1.0 - s) + sqrt(max((1.0 - s) * (1.0 - s) + 4.0 * s * u, 0.0)), 1e-30);
}

// Unit square to a regular polygon inscribed in the unit circle, uniform by area.
vec2 polygon_point(vec2 square, int blades, float rotation) {
    float n = float(blades);
    float blade = min(floor(n * square.x), n - 1.0);
    float theta = atan((2.0 * (n * square.x - blade) - 1.0) * tan(PI / n));
    float radius = sqrt(square.y) * cos(PI / n) / cos(theta);
    float angle = (blade + 0.5) * (2.0 * PI / n) + theta + rotation;
    return radius * vec2(cos(angle), sin(angle));
}

// A point of the aperture from a point of the unit square.
vec2 lens_point(vec2 square, int blades, float rotation, float anamorphic, float aberration) {
    vec2 point;
    if (blades < 3) {
        point = concentric_disc(square);
        float area = dot(point, point);
        if (aberration != 0.0 && area > 0.0) point *= sqrt(aberrated_area(area, aberration) / area);
        float c = cos(rotation), s = sin(rotation);
        point = vec2(c * point.x - s * point.y, s * point.x + c * point.y);
    } else {
        point = polygon_point(vec2(square.x, aberrated_area(square.y, aberration)), blades, rotation);
    }
    return vec2(point.x / anamorphic, point.y);
}

// Mean square distance of the aperture's light from its centre: of a disc 1/2, of a regular n-gon in the unit circle
// (2 + cos(2 pi / n)) / 6; aberration s moves the enclosed-area fraction's mean from 1/2 to 1/2 + s/6.
float lens_spread(int blades, float anamorphic, float aberration) {
    float even = blades < 3 ? 0.5 : (2.0 + cos(2.0 * PI / float(blades))) / 6.0;
    return even * (1.0 + aberration / 3.0) * 0.5 * (1.0 + 1.0 / (anamorphic * anamorphic));
}

// Where the barrel's disc lies, seen from a point of the image: cat-eye vignetting. Light from off the axis must also
// pass a second rim in front of the aperture, of the lens' own radius, and crosses it on the side it comes from; so
// what passes is a disc shifted away from what is looked at, by cat_eye in the picture's corners.
vec2 barrel_shift(vec2 image_px, vec2 size_px, float cat_eye) {
    return -cat_eye * (2.0 * image_px - size_px) / length(size_px);
}

bool passes_barrel(vec2 point, vec2 shift) {
    vec2 apart = point - shift;
    return dot(apart, apart) <= 1.0;
}

// The factor that lengthens `point` (not 0) until it meets the barrel's rim, for a shift no longer than 1.
float barrel_reach(vec2 point, vec2 shift) {
    float square = dot(point, point), along = dot(point, shift), rest = max(1.0 - dot(shift, shift), 0.0);
    return (along + sqrt(along * along + square * rest)) / square;
}
