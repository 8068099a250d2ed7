// Looks out for near blur that comes from what the raster image does not hold: surfaces beyond the picture's rim,
// hidden behind others, or so close to the lens that a pinhole misses them. The mask's edges cannot tell of them.
// Reads: depth (m, full resolution), last frame's scout; the scene and its ray-tracing tree.
// Writes: scout (x: share of lens rays that hit such a surface, y: rays that say so; one texel per 16x16 px).
// Method: one lens ray a tile and frame, at random, and several in the first frame; a hit in front of focus counts
// unless the raster image shows that very surface at the hit's place in it. A running mean; while something moves, one
// that forgets.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/sampling.glsl"
#include "lib/mask.glsl"
#include "lib/tile.glsl"
#include "rays/lens_ray.glsl"
#include "rays/hit.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_depth;
uniform sampler2D prev_scout;
layout(rg32f) uniform writeonly image2D out_scout;

const float SAME_SURFACE = 0.02;   // relative difference of depth: what a surface may slope by within a pixel or two
const float NEWEST_MOVING = 0.1;   // weight of the newest ray while something moves: ten frames of memory
const uint FIRST_RAYS = 8u;        // a tenth of the lens is then missed in less than half of the tiles
const uint SCOUT_STREAM = 0x68bc21ebu;  // sets the tiles' samples apart from the pixels'

// Whether the raster image shows the surface at `position` [m] of planar depth `z` [m].
bool seen(vec3 position, float z) {
    vec4 clip = frame.this_view_proj * vec4(position, 1.0);
    ivec2 pixel = ivec2(floor((0.5 + 0.5 * clip.xy / max(clip.w, 1e-6)) * frame.size_px));
    for (int i = 0; i < 9; i++) {
        ivec2 there = pixel + ivec2(i % 3, i / 3) - 1;
        if (any(lessThan(there, ivec2(0))) || any(greaterThanEqual(there, ivec2(frame.size_px)))) continue;
        if (abs(fetch_depth(in_depth, there) - z) <= SAME_SURFACE * z) return true;
    }
    return false;
}

// 1 if the ray finds near blur that the raster image does not hold.
float found(ivec2 tile, uint index) {
    uint seed = pixel_seed(uvec2(tile), frame.seed ^ SCOUT_STREAM);
    vec4 s = sobol4(index, seed);
    vec2 pixel_px = min(TILE_PX * (vec2(tile) + s.zw), frame.size_px);
    Ray ray = lens_ray(pixel_px, lens_sample(pixel_px, s.xy, index, seed));
    Hit hit;
    if (!trace_closest(ray, SKY_DEPTH, hit)) return 0.0;
    if (coc_px(hit.t, frame.coc_scale_px, frame.inverse_focus) > -RAYS_BEGIN_PX) return 0.0;
    return seen(ray.origin + hit.t * ray.direction, hit.t) ? 0.0 : 1.0;
}

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, imageSize(out_scout)))) return;
    vec2 scout = frame.history_valid != 0u ? fetch_finite(prev_scout, tile).xy : vec2(0.0);
    float least = frame.moved != 0u ? NEWEST_MOVING : 0.0;
    for (uint rays = frame.history_valid != 0u ? 1u : FIRST_RAYS; rays > 0u; rays--) {
        float here = found(tile, uint(scout.y));
        scout.y += 1.0;
        scout.x = mix(scout.x, here, max(1.0 / scout.y, least));
    }
    imageStore(out_scout, tile, vec4(scout, 0.0, 0.0));
}
