// Where rays are needed and how many: response, reach and feather of the ray mask. Float64 twins:
// tests/gpu/hybrid_twin.py.

// Half-res px added to an edge's reach: a block stands for four pixels up to 0.71 half-res px from its centre, and
// the Sobel filter may place an edge one full-res pixel beside the silhouette.
const float REACH_MARGIN_HALF = 1.0;

// Part of an edge's reach over which rays fade in. The lens sees past a straight silhouette by less than 7.3 % of its
// area there: the circular segment beyond 3/4 of the radius.
const float RIM = 0.25;

// CoC radii over which rays take over from the post-process, whose full-resolution gather of slight defocus shows
// more detail than rays traced per 2x2 px.
const float RAYS_BEGIN_PX = 2.0;
const float RAYS_END_PX = 4.0;

// Response 0..1 to a gradient (poster, 2.1: x = (dd + dn) s, then 1 - 1/(x + 1)).
float mask_response(float gradient, float sensitivity) {
    return 1.0 - 1.0 / (sensitivity * gradient + 1.0);
}

// The slope of the surface itself from three successive differences: the smallest if all agree in sign, else none
// (minmod, Roe 1986). CoC is linear on screen over a plane, so a plane is no edge however steep, and a step never
// hides in its neighbours' slope.
float own_slope(vec3 differences) {
    vec3 size = abs(differences);
    vec3 s = sign(differences);
    return s.x == s.y && s.y == s.z ? s.x * min(size.x, min(size.y, size.z)) : 0.0;
}

// How far [half-res px] the blur of a near surface of signed CoC radius `coc` [full-res px] carries its edge; 0 where
// rays gain nothing.
float edge_reach_half(float coc) {
    return coc < -RAYS_BEGIN_PX ? -0.5 * coc + REACH_MARGIN_HALF : 0.0;
}

// Weight of rays at a pixel inside an edge's reach [half-res px], from power = reach^2 - distance^2: 0 on the rim, 1
// within 1 - RIM of it.
float rays_feather(float power, float reach) {
    float from_rim = 1.0 - sqrt(max(1.0 - power / (reach * reach), 0.0));
    return smoothstep(0.0, RIM, from_rim) * smoothstep(RAYS_BEGIN_PX, RAYS_END_PX, 2.0 * (reach - REACH_MARGIN_HALF));
}

// Mean rays for a mask level 1..255 when the budget allows `scale` per level.
float planned_rays(float level, float scale, float fewest, float most) {
    return clamp(scale * level, fewest, most);
}
