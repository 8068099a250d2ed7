// Finds the edges past which the lens may see more than the raster image holds.
// Reads: mask_smooth (xyz: normal, w: CoC, px), mask_slope (x: most negative CoC, px; yz: the surface's own slope of
//   CoC), half resolution.
// Writes: mask_edges (x: response 0..1, 0 below the threshold; y: reach of the edge's near blur, half-res px, 0 if
//   nothing near), half resolution; mask_tiles (largest reach in the tile, half-res px; one texel per 8x8 half-res
//   px).
// Over: the tiles of EdgeTiles; elsewhere what it writes is 0.
// Fills: MaskReach (the largest reach of all edges, as float bits).
// Method: poster (Tan et al. 2020), 2.1: a 5x5 Sobel kernel on smoothed normal and depth. Depth is measured in CoC px,
// in which an edge matters by how far its blur moves, whatever the scene's scale; the surface's own slope is taken off.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/mask.glsl"
#include "dof/beyond.glsl"
#include "dof/edge_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_mask_smooth;
uniform sampler2D in_mask_slope;
layout(rg16f) uniform writeonly image2D out_mask_edges;
layout(r32f) uniform writeonly image2D out_mask_tiles;
layout(std430) buffer MaskReach { uint largest_reach; };  // bits: positive floats are ordered as their bits are

const float SMOOTHING[5] = float[5](1.0, 4.0, 6.0, 4.0, 1.0);     // of the Sobel kernel across the derivative
const float DERIVATIVE[5] = float[5](-1.0, -2.0, 0.0, 2.0, 1.0);  // along it
const float RAMP = 128.0;  // the kernel's answer to a slope of one per texel

shared uint tile_reach;  // bits of the largest reach in the tile

// Change of normal and CoC per half-res px along x and y.
void sobel(ivec2 p, out vec4 dx, out vec4 dy) {
    dx = dy = vec4(0.0);
    for (int y = 0; y < 5; y++) {
        for (int x = 0; x < 5; x++) {
            vec4 value = within_or_beyond(in_mask_smooth, p + ivec2(x, y) - 2);
            dx += DERIVATIVE[x] * SMOOTHING[y] * value;
            dy += DERIVATIVE[y] * SMOOTHING[x] * value;
        }
    }
    dx /= RAMP;
    dy /= RAMP;
}

// The most negative CoC [px] in the 3x3 half-res px around p.
float nearest_around(ivec2 p) {
    ivec2 last = textureSize(in_mask_slope, 0) - 1;
    float lowest = 0.0;
    for (int i = 0; i < 9; i++) {
        lowest = min(lowest, fetch_finite(in_mask_slope, clamp(p + ivec2(i % 3, i / 3) - 1, ivec2(0), last)).x);
    }
    return lowest;
}

// Response and reach of the pixel as an edge; zero if it is none. A line one pixel wide has its gradient beside it: an
// edge takes the nearest surface among its neighbours.
vec2 edge_at(ivec2 p) {
    float reach = edge_reach_half(nearest_around(p));
    if (reach <= 0.0) return vec2(0.0);
    vec4 dx, dy;
    sobel(p, dx, dy);
    float dn = sqrt(dot(dx.xyz, dx.xyz) + dot(dy.xyz, dy.xyz));
    float dd = length(vec2(dx.w, dy.w) - fetch_finite(in_mask_slope, p).yz);
    float response = mask_response(dd + dn, frame.mask_sensitivity);
    return response >= frame.mask_threshold && response > 0.0 ? vec2(response, reach) : vec2(0.0);
}

void main() {
    ivec2 tile = listed_tile(), p = texel_of(tile, 8);
    if (tile.x < 0) return;
    bool inside = all(lessThan(p, imageSize(out_mask_edges)));
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) tile_reach = 0u;
    barrier();
    vec2 edge = vec2(0.0);
    if (inside) edge = edge_at(p);
    // What is stored is what the tile must cover, so round as the float16 target does.
    if (edge.y > 0.0) atomicMax(tile_reach, floatBitsToUint(unpackHalf2x16(packHalf2x16(edge)).y));
    barrier();
    if (inside) imageStore(out_mask_edges, p, vec4(edge, 0.0, 0.0));
    if (lane > 0u) return;
    imageStore(out_mask_tiles, tile, vec4(uintBitsToFloat(tile_reach)));
    if (tile_reach > 0u) atomicMax(largest_reach, tile_reach);
}
