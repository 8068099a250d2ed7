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

// What a full edge response is worth beside a deviation of 0..0.5, times the gain: little, so that measured noise
// decides where it is known, and the response among pixels without any.
const float EDGE_WORTH = 0.1;

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

// Reach beyond which nothing changes [half-res px]: a picture of 16384 x 16384 px, the most that drivers offer, has a
// half-res diagonal of 11 586 px and thus lies within 1 - RIM of it as a whole. float16 holds it, and no count of
// texels overflows.
const float MOST_REACH_HALF = 16384.0;

// How far [half-res px] the blur of a near surface of signed CoC radius `coc` [full-res px] carries its edge; 0 where
// rays gain nothing.
float edge_reach_half(float coc) {
    return coc < -RAYS_BEGIN_PX ? min(-0.5 * coc + REACH_MARGIN_HALF, MOST_REACH_HALF) : 0.0;
}

// Texels that a row of the dilation searches to either side at most: then the mask's texel is 1/64 of the largest blur.
const float FARTHEST_TEXELS = 32.0;

// How often the mask's resolution is halved, for the largest reach of an edge [half-res px].
int mask_level(float largest_reach) {
    return max(int(ceil(log2(max(largest_reach, 1.0) / FARTHEST_TEXELS))), 0);
}

// Half-res px from the centre of a square of `side` x `side` half-res texels to the centre of the one in its corner.
float coarse_margin_half(int side) {
    return 0.70710678 * float(side - 1);
}

// Centre of coarse texel i along an axis, where half-res texel j has its centre at j.
float coarse_center(int i, int side) {
    return float(i * side) + 0.5 * float(side - 1);
}

// First and last coarse texel that may hold an edge of reach `farthest` [half-res px] from half-res texel p, of `size`
// half-res texels. The coarse edges' grown reach is allowed for.
ivec2 coarse_span(int p, float farthest, int side, int size) {
    int reach = int(farthest + coarse_margin_half(side));
    return ivec2(max(p - reach, 0), min(p + reach, size - 1)) / side;
}

// Weight of rays at a pixel inside an edge's reach [half-res px], from power = reach^2 - distance^2: 0 on the rim, 1
// within 1 - RIM of it.
float rays_feather(float power, float reach) {
    float from_rim = 1.0 - sqrt(max(1.0 - power / (reach * reach), 0.0));
    return smoothstep(0.0, RIM, from_rim) * smoothstep(RAYS_BEGIN_PX, RAYS_END_PX, 2.0 * (reach - REACH_MARGIN_HALF));
}

// Weight of rays where scouts hit unseen near surfaces with a share of `found`: all from a twentieth on, which moves a
// pixel by a twentieth of the contrast; none below a hundredth, which is lost in the noise.
float scouted_share(float found) {
    return smoothstep(0.01, 0.05, found);
}

// Standard deviation per ray of a pixel's light, from the means of compressed luminance and of its square, of the near
// (xy) and of the far part (zw): each ray falls into one or the other, or its shares add to one.
float light_deviation(vec4 moments) {
    float mean = moments.x + moments.z;
    return sqrt(max(moments.y + moments.w - mean * mean, 0.0));
}

// What a pixel is worth in the ray budget, 0..1: its edge's response, and `gain` times its rays' deviation. Unknown
// deviation (negative) is worth all.
float ray_weight(float response, float deviation, float gain) {
    return gain > 0.0 && deviation < 0.0 ? 1.0 : clamp(EDGE_WORTH * response + gain * deviation, 0.0, 1.0);
}

// A mask level between 0 and the first: such a pixel keeps its light and asks for no rays.
const float SETTLED = 1.0 / 1024.0;

// Rays that a pixel must hold to be settled, and each of the eight around it: light that reaches one ray in 128 is then
// missed by all of them with a chance of a ninetieth.
const float SETTLED_RAYS = 64.0;

// Error that half an 8-bit step of the display hides, at a mean luminance: both compressed, and so about the display's
// linear light, of which it shows the power 1/2.2.
float hidden_error(float mean) {
    return 0.5 / 255.0 * 2.2 * pow(max(mean, 1e-3), 1.2 / 2.2);
}

// Whether `rays` of this deviation and mean leave less noise than a display shows. Dependent samples would do better
// than the square root that is assumed.
bool settled(float deviation, float mean, float rays, float exposure) {
    return rays >= SETTLED_RAYS && deviation * inversesqrt(rays) * max(exposure, 1.0) <= hidden_error(mean);
}

// Mean rays for a mask level 1..255 when the budget allows `scale` per level.
float planned_rays(float level, float scale, float fewest, float most) {
    return clamp(scale * level, fewest, most);
}
