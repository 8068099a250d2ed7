// The taps of the gather kernels: where in the aperture they lie, what the lens' barrel leaves of them, and how much of
// a splat's light each stands for. For the passes that gather over the aperture.
// Method: the open part of the lens, aperture and barrel together, is seen from the lens' centre as far as `openness`
// of the aperture's rim, in each direction. A tap moves inwards by that factor and stands for its square of the area,
// so rings stay rings of a splat of any radius, and their shares add to 1 exactly, as without a barrel.
#include "shared/frame.glsl"
#include "lib/kernel.glsl"
#include "lib/splat.glsl"

uniform sampler2D in_kernel;  // points of the aperture, half lens diameters: kernel.comp

struct Kernel {
    int rings, row;       // of the target `kernel`
    uint index_of_frame;  // that turned it
};

// What is open of the lens, seen from one pixel.
struct Opening {
    vec2 shift;        // of the barrel's disc, half lens diameters
    vec2 middle;       // centroid, half lens diameters
    float aberration;  // s of the area weight, as the open part has it
    float spread;      // mean square distance of its light from the middle, as lens_spread
};

struct Ring {
    int row, first, end;            // its taps: first to end - 1 of a row of the target `kernel`
    float inner2, outer2, spacing;  // squares of its rims, px^2; distance of the kernel's rings, px
    float gauge;                    // of its taps: where between the aperture's centre, 0, and rim, 1, they lie
    vec2 open;                      // mean of the square and of the fourth power of its taps' openness
};

struct Tap {
    vec2 point;   // half lens diameters
    vec2 weight;  // its part of the ring's light: of what grows with the splat's area, and with the area's square
};

// The kernel of n rings as this frame turns it, or as every frame has it.
Kernel turned_kernel(int n) { return Kernel(n, n, frame.frame_index); }
Kernel still_kernel(int n) { return Kernel(n, UNTURNED + n, 0u); }

vec2 aperture_tap(int row, int i) {
    return texelFetch(in_kernel, ivec2(i, row), 0).xy;
}

#if CAT_EYE
// Seen from a point of the image. In a sector of the aperture that is open as far as o, the enclosed area t goes to o^2
// and a point's distance with its root; the area weight 1 + s (2t - 1) gives each moment an even and an aberrated part.
Opening opening_at(vec2 image_px) {
    vec2 shift = barrel_shift(image_px, frame.size_px, frame.lens_cat_eye), middle = vec2(0.0);
    float s = frame.lens_aberration, light = 0.0, aberrated = 0.0, square = 0.0;
    for (int i = 0; i < RIM_POINTS; i++) {
        vec2 rim = aperture_tap(0, i);
        float open = min(1.0, barrel_reach(rim, shift)), open2 = open * open;
        light += open2 * mix(1.0, open2, s);
        aberrated += open2 * open2 * s;
        middle += open2 * open * mix(2.0 / 3.0, 4.0 / 5.0 * open2, s) * rim;
        square += open2 * open2 * mix(1.0 / 2.0, 2.0 / 3.0 * open2, s) * dot(rim, rim);
    }
    light = max(light, 1e-6);  // a pinhole's worth, in the very corner
    middle /= light;
    return Opening(shift, middle, aberrated / light, square / light - dot(middle, middle));
}

float openness(vec2 point, float gauge, vec2 shift) {
    return gauge == 0.0 ? 1.0 : min(1.0, gauge * barrel_reach(point, shift));
}
#else
Opening opening_at(vec2 image_px) {
#if ABERRATION
    float s = frame.lens_aberration;
#else
    const float s = 0.0;
#endif
    return Opening(vec2(0.0), vec2(0.0), s, lens_spread(BLADES, frame.lens_anamorphic, s));
}
#endif

// Radius [px] of a kernel of n rings for splats of up to `radius2` [px^2]. Where aberration brightens the rim, rings of
// even light need room beyond it: fitted_px2 asks for at most this much.
float kernel_px(float radius2, int n, Opening opening) {
    float rims = float(n) + 0.5;
    return sqrt(radius2 * (1.0 + max(opening.aberration, 0.0) * 2.0 / (3.0 * rims * rims)));
}

// Ring k of a kernel of `radius` px.
Ring ring_at(Kernel kernel, int k, float radius, Opening opening) {
    int n = kernel.rings, first = first_tap(k), end = first + ring_taps(k);
    float inner = k == 0 ? 0.0 : radius * ring_rim(k - 1, n), outer = radius * ring_rim(k, n);
    Ring ring = Ring(kernel.row, first, end, inner * inner, outer * outer, radius / (float(n) + 0.5), 0.0, vec2(1.0));
#if CAT_EYE
    ring.gauge = tap_gauge(k, n, kernel.index_of_frame);
    ring.open = vec2(0.0);
    for (int i = first; i < end; i++) {
        float open = openness(aperture_tap(ring.row, i), ring.gauge, opening.shift), open2 = open * open;
        ring.open += vec2(open2, open2 * open2) / float(end - first);
    }
#endif
    return ring;
}

Tap tap_at(int i, Ring ring, Opening opening) {
    vec2 even = vec2(1.0 / float(ring.end - ring.first)), point = aperture_tap(ring.row, i);
#if CAT_EYE
    float open = openness(point, ring.gauge, opening.shift), open2 = open * open;
    return Tap(open * point, even * vec2(open2, open2 * open2) / max(ring.open, 1e-12));
#else
    return Tap(point, even);
#endif
}

// Share of the light of a splat of squared radius `radius2` [px^2] that lands on a tap.
float tap_light(float radius2, Ring ring, Tap tap, Opening opening) {
#if CAT_EYE || ABERRATION
    float fitted = fitted_px2(radius2, ring.spacing, opening.aberration);
#else
    float fitted = fitted_even_px2(radius2, ring.spacing);
#endif
#if CAT_EYE
    vec2 parts = ring_area(ring.inner2, ring.outer2, fitted) * tap.weight;
    return mix(parts.x, parts.y, opening.aberration);
#else
    return ring_light(ring.inner2, ring.outer2, fitted, opening.aberration) * tap.weight.x;
#endif
}
