// What one sample of the image adds to its neighbours: the splat of its circle of confusion, cut into the rings of a
// gather kernel, and the split of samples into layers. Float64 twins: tests/gpu/post_twin.py. Radii and CoC in full-res
// px; a "gauge" is a distance measured by the aperture.

const float SMALLEST_SPLAT_PX2 = 1e-6;  // squared radius; keeps the division finite, far within the centre tap

// The CoC that the post-process gathers: within +-limit, 0 for NaN.
float gathered_coc(float coc, float limit) {
    return coc >= -limit ? min(coc, limit) : (coc < 0.0 ? -limit : 0.0);
}

// The radius with which sample `coc` shows at a pixel of CoC `own`: the nearer surface of the two draws the silhouette
// between them, so its blur is the blur of the edge. What lies in focus therefore never leaks into what lies behind it,
// nor the reverse.
float silhouette_px(float own, float coc) {
    return abs(min(own, coc));
}

// Share of a splat's light within enclosed-area fraction t of it: the integral of the aberration weight 1 + s (2t - 1).
float enclosed_light(float t, float aberration) {
    t = min(t, 1.0);
    return t * (1.0 - aberration + aberration * t);
}

// Share of the light of a splat between the gauges whose squares are inner2 and outer2; radius2 is the square of its
// radius. The shares of adjoining rings add to 1 exactly, so that a surface of constant CoC is covered exactly whatever
// the kernel's radius: no noise, no darkening, no see-through interior.
float ring_light(float inner2, float outer2, float radius2, float aberration) {
    float inverse2 = 1.0 / max(radius2, SMALLEST_SPLAT_PX2);
    return enclosed_light(outer2 * inverse2, aberration) - enclosed_light(inner2 * inverse2, aberration);
}

// The same, unweighted, of the enclosed-area fraction t (x) and of its square (y): (1 - s) x + s y is ring_light.
vec2 ring_area(float inner2, float outer2, float radius2) {
    vec2 t = min(vec2(inner2, outer2) / max(radius2, SMALLEST_SPLAT_PX2), 1.0);
    return vec2(t.y - t.x, t.y * t.y - t.x * t.x);
}

// Squared radius of a splat of `radius` that gives up `variance` along each axis, but no more than half its radius.
// `spread` is the mean square distance of the light of a splat of radius 1 from its middle.
float shrunk_px2(float radius, float variance, float spread) {
    float square = radius * radius;
    return max(square - 2.0 * variance / spread, 0.25 * square);
}

// Squared radius to share out over rings `spacing` apart in place of `radius2`, so that what is drawn is as wide as the
// splat is. A ring spreads its share over its whole area: the one that the splat ends in beyond the splat's rim, the
// others evenly, whatever the aberration s. With the rims of that ring, j, at a and b (squared, in squares of the
// spacing), the second moment of what is drawn is a quadratic in y, the inverse of the squared radius:
//     (a + b) / 2 - y (1 - s) a b / 2 - y^2 s (3 a^2 b - a^3 + 2 j^2 (j - 1)^2) / 6,
// and it shall be that of the splat, radius2 (1/2 + s / 6).
float fitted_px2(float radius2, float spacing, float s) {
    float unit2 = spacing * spacing, t = radius2 / unit2, j = ceil(sqrt(t) - 0.5);
    if (j < 2.0) return radius2;  // one ring about the centre tap: narrower, it would draw a point with a halo
    float a = (j - 0.5) * (j - 0.5), b = (j + 0.5) * (j + 0.5), inner = j * (j - 1.0);
    float constant = 0.5 * (a + b) - t * (0.5 + s / 6.0), linear = 0.5 * (1.0 - s) * a * b;
    float square = s * (3.0 * a * a * b - a * a * a + 2.0 * inner * inner) / 6.0;
    float y = 2.0 * constant / max(linear + sqrt(max(linear * linear + 4.0 * square * constant, 0.0)), 1e-6);
    return unit2 / clamp(y, 1.0 / b, 1.0 / a);
}

// The same of an even splat, s = 0, for which the quadratic is a line: y = (a + b - t) / (a b).
float fitted_even_px2(float radius2, float spacing) {
    float unit2 = spacing * spacing, t = radius2 / unit2, j = ceil(sqrt(t) - 0.5);
    if (j < 2.0) return radius2;
    float a = (j - 0.5) * (j - 0.5), b = (j + 0.5) * (j + 0.5);
    return unit2 * clamp(a * b / max(a + b - t, 1e-6), a, b);
}

// 1 for a sample that belongs to the blurred near layer, 0 from the in-focus zone backwards, smooth between |coc| =
// begin and end.
float front_share(float coc, float begin, float end) {
    return smoothstep(begin, end, -coc);
}

// Presort (Jimenez 2014, DepthCmp2, on CoC instead of depth): 1 for the nearest surface that reaches the tile, 0 for
// what lies `fade` px behind.
float fore_share(float coc, float nearest, float fade) {
    return 1.0 - smoothstep(0.0, 1.0, (coc - nearest) / fade);
}

// Two layers that together may claim more than the whole lens: the front one keeps its share, the one behind gets what
// is left open. Premultiplied, a = coverage.
vec4 stacked(vec4 fore, vec4 behind) {
    fore /= max(fore.a, 1.0);
    return fore + behind * min(1.0, (1.0 - fore.a) / max(behind.a, 1e-6));
}
