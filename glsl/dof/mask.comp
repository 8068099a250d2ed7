// Completes the ray mask: dilates along columns, says how much each pixel is worth in the ray budget, and counts that.
// Reads: mask_rows (x: power, half-res px^2; y: reach, half-res px; z: response; w: half-res px a row) and mask_reach
//   (farthest edge to look for, half-res px, per tile), or every pixel is masked; motion (px) while something moves;
//   last frame's layer_state (x, y: rays) and layer_moments (compressed luminance and its square, of the near and the
//   far part); scout (x: share of rays that find unseen near surfaces, one texel per 8x8 half-res px) if there are any.
// Writes: mask (x: weight in the ray budget in steps of 1/255, 0: no rays, between 0 and 1: no more rays; y: weight of
//   rays in the composite, 0..1), half resolution.
// Over: the tiles with rays of RayTiles; elsewhere what it writes is 0.
// Fills: RayHistogram (masked pixels per weight step).
// Method: dilation as in mask_rows.comp. The weight is the poster's (2.1): the edge response, raised by the deviation
// of the rays from the moments accumulated so far (Schied et al. 2017), of the pixels around; a pixel without history
// gets all it can. A still pixel that is settled (SETTLE) keeps its light and gets no more. Counts are
// integers, so that they come out the same in any order.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/mask.glsl"
#include "dof/ray_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
#if HAS_MASK_ROWS && HAS_MASK_REACH
uniform sampler2D in_mask_rows;
uniform sampler2D in_mask_reach;
#endif
uniform sampler2D prev_layer_state;
uniform sampler2D prev_layer_moments;
#if HAS_MOTION
uniform sampler2D in_motion;
#endif
#if HAS_SCOUT
uniform sampler2D in_scout;
#endif
layout(rg16f) uniform writeonly image2D out_mask;
layout(std430) buffer RayHistogram { uint pixels_of_level[256]; };

shared uint counted[256];

// What is known of a pixel's light.
struct Noise {
    float deviation;  // per ray, of the compressed luminance of the pixels around; negative: unknown
    float mean;       // of the same
    float rays;       // that the pixel holds
    float around;     // that its neighbours hold
};
const Noise UNKNOWN = Noise(-1.0, 0.0, 0.0, 0.0);

// Deviation per ray of the light around p, from last frame's moments; negative where nothing was traced. The neighbours
// tell, not the pixel itself: rays that decided how many follow them would count for less than the others, and with
// points that avoid each other the mean would be biased.
Noise noise_at(ivec2 p) {
    if (frame.history_valid == 0u) return UNKNOWN;
    ivec2 last = textureSize(prev_layer_state, 0) - 1, from = p;
#if HAS_MOTION
    from -= ivec2(round(0.5 * fetch_finite(in_motion, min(2 * p, ivec2(frame.size_px) - 1)).xy));
#endif
    if (any(lessThan(from, ivec2(0))) || any(greaterThan(from, last))) return UNKNOWN;
    vec4 own = fetch_finite(prev_layer_state, from);
    if (own.w == 0.0) return UNKNOWN;
    vec4 moments = vec4(0.0);
    float rays = 0.0;
    for (int i = 0; i < 9; i++) {
        ivec2 offset = ivec2(i % 3, i / 3) - 1, there = clamp(from + offset, ivec2(0), last);
        vec4 state = fetch_finite(prev_layer_state, there);
        float weight = offset == ivec2(0) ? 0.0 : min(state.x, state.y);
        moments += weight * fetch_light(prev_layer_moments, there);
        rays += weight;
    }
    if (rays == 0.0) return UNKNOWN;
    moments /= rays;
    return Noise(light_deviation(moments), moments.x + moments.z, min(own.x, own.y), rays);
}

// What scouts make of a pixel, 0..1: their finds around it under a quadratic B-spline, smooth across tiles.
float scouted(ivec2 p) {
    float found = 0.0;
#if HAS_SCOUT
    vec2 at = (vec2(p) + 0.5) / 8.0, f = fract(at) - 0.5;
    ivec2 tile = ivec2(floor(at)), last = textureSize(in_scout, 0) - 1;
    for (int i = 0; i < 9; i++) {
        ivec2 step = ivec2(i % 3, i / 3) - 1;
        vec2 side = 0.5 + vec2(step) * f, weight = mix(0.5 * side * side, 0.75 - f * f, equal(step, ivec2(0)));
        found += weight.x * weight.y * fetch_finite(in_scout, clamp(tile + step, ivec2(0), last)).x;
    }
#endif
    return scouted_share(found);
}

// Response and feather at p, from the rows above and below; all there is where nothing tells of edges.
vec2 dilated(ivec2 p, ivec2 tile, int height) {
#if HAS_MASK_ROWS && HAS_MASK_REACH
    int side = int(fetch_finite(in_mask_rows, ivec2(p.x, 0)).w);
    float farthest = fetch_finite(in_mask_reach, tile).r;
    ivec2 span = coarse_span(p.y, farthest, side, height);
    vec2 best = vec2(0.0);
    for (int y = span.x; y <= span.y && farthest > 0.0; y++) {
        vec4 row = fetch_finite(in_mask_rows, ivec2(p.x, y));
        float distance = coarse_center(y, side) - float(p.y);
        float power = row.x - distance * distance;
        if (power >= 0.0) best = max(best, vec2(row.z, rays_feather(power, row.y)));
    }
    return best;
#else
    return vec2(1.0);
#endif
}

void main() {
    ivec2 tile = listed_tile(), p = texel_of(tile, 8);
    if (tile.x < 0) return;
    ivec2 size = imageSize(out_mask);
    uint lane = gl_LocalInvocationIndex;
    for (uint level = lane; level < 256u; level += 64u) counted[level] = 0u;
    barrier();
    if (all(lessThan(p, size))) {
        vec2 mask = max(dilated(p, tile, size.y), vec2(scouted(p)));
        uint level = 0u;
        if (mask.x > 0.0) {
            Noise noise = noise_at(p);
            float weight = ray_weight(mask.x, noise.deviation, frame.mask_variance);
            level = clamp(uint(255.0 * weight + 0.5), 1u, 255u);
#if SETTLE && !HAS_MOTION
            float least = min(noise.rays, noise.around / 8.0);
            if (noise.deviation >= 0.0 && settled(noise.deviation, noise.mean, least, frame.exposure)) level = 0u;
#endif
        }
        float share = level == 0u && mask.x > 0.0 ? SETTLED : float(level) / 255.0;
        imageStore(out_mask, p, vec4(share, mask.y, 0.0, 0.0));
        if (level > 0u) atomicAdd(counted[level], 1u);
    }
    barrier();
    for (uint level = lane; level < 256u; level += 64u) {
        if (counted[level] > 0u) atomicAdd(pixels_of_level[level], counted[level]);
    }
}
