// Where rays are needed and how many: response, reach and feather of the ray mask. Float64 twins: app/hybrid_math.py.

// Half-res px added to an edge's reach: a block stands for four pixels up to 0.71 half-res px from its centre, and the Sobel
// filter may place an edge one full-res pixel beside the silhouette.
const float REACH_MARGIN_HALF = 1.0;

// Part of an edge's reach over which rays fade in. The lens sees past a straight silhouette by less than 7.3 % of its area there: the
// circular segment beyond 3/4 of the radius.
const float RIM = 0.25;

// Response 0..1 to a gradient (poster, 2.1: x = (dd + dn) s, then 1 - 1/(x + 1)).
float mask_response(float gradient, float sensitivity) {
    return 1.0 - 1.0 / (sensitivity * gradient + 1.0);
}

// The slope of the surface itself from three successive differences: the smallest if all agree in sign, else none (minmod, Roe 1986).
// CoC is linear on screen over a plane, so a plane is no edge however steep, and a step never hides in its neighbours' slope.
float own_slope(vec3 differences) {
    vec3 size = abs(differences);
    vec3 s = sign(differences);
    return s.x == s.y && s.y == s.z ? s.x * min(size.x, min(size.y, size.z)) : 0.0;
}

// How far [half-res px] the blur of a near surface of signed CoC radius `coc` [full-res px] carries its edge; 0 if it is not near.
float edge_reach_half(float coc, float in_focus_px) {
    return coc < -in_focus_px ? -0.5 * coc + REACH_MARGIN_HALF : 0.0;
}

// Weight of rays at a pixel inside an edge's reach, from power / reach^2 = 1 - (distance / reach)^2: 0 on the rim, 1 within 1 - RIM.
float rim_feather(float relative_power) {
    return smoothstep(0.0, RIM, 1.0 - sqrt(max(1.0 - relative_power, 0.0)));
}

// Mean rays for a mask level 1..255 when the budget allows `scale` per level.
float planned_rays(float level, float scale, float fewest, float most) {
    return clamp(scale * level, fewest, most);
}
