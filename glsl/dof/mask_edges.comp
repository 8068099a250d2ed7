// Finds the edges past which the lens may see more than the raster image holds.
// Reads: mask_guide (xyz: mean normal, w: mean CoC, px), mask_slope (x: most negative CoC, px; yz: the surface's own
//   slope of CoC), half resolution; tiles (x: most negative CoC, px).
// Writes: mask_edges (x: response 0..1, 0 below the threshold; y: reach of the edge's near blur, half-res px, 0 if
//   nothing near), half resolution; mask_tiles (largest reach in the tile, half-res px; one texel per 8x8 half-res
//   px).
// Fills: MaskReach (the largest reach of all edges, as float bits).
// Method: poster (Tan et al. 2020), 2.1: a Gaussian on the G-buffer, then a 5x5 Sobel kernel on normal and depth.
// Depth is measured in CoC px, in which an edge matters by how far its blur moves, whatever the scene's scale; the
// surface's own slope is taken off. One work group smooths in shared memory.
#include "shared/frame.glsl"
#include "lib/mask.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_mask_guide;
uniform sampler2D in_mask_slope;
uniform sampler2D in_tiles;
layout(rg16f) uniform writeonly image2D out_mask_edges;
layout(r32f) uniform writeonly image2D out_mask_tiles;
layout(std430) buffer MaskReach { uint largest_reach; };  // bits: positive floats are ordered as their bits are

const int SOBEL = 2;     // radius of the Sobel kernel, half-res px
const int GAUSS = 3;     // of the Gaussian: two standard deviations of its largest setting, 3 px = 1.5 half-res px
const int SMOOTH = 8 + 2 * SOBEL;      // side of the smoothed block
const int LOADED = SMOOTH + 2 * GAUSS; // side of the loaded block

const float SMOOTHING[5] = float[5](1.0, 4.0, 6.0, 4.0, 1.0);     // of the Sobel kernel across the derivative
const float DERIVATIVE[5] = float[5](-1.0, -2.0, 0.0, 2.0, 1.0);  // along it
const float RAMP = 128.0;  // the kernel's answer to a slope of one per texel

shared vec4 loaded[LOADED * LOADED];     // xyz: normal, w: CoC, means over 2x2 px
shared vec4 rows[SMOOTH * LOADED];       // after the horizontal Gaussian
shared vec4 smoothed[SMOOTH * SMOOTH];   // after both
shared float nearest[LOADED * LOADED];   // most negative CoC of the 2x2 px
shared uint tile_reach;                  // bits of the largest reach in the tile

// Beyond the picture the CoC goes on as steeply as it came (mirrored in the edge's value), so that a slanted plane
// ends without an edge.
void load(int slot, ivec2 corner) {
    ivec2 last = textureSize(in_mask_guide, 0) - 1;
    ivec2 block = corner + ivec2(slot % LOADED, slot / LOADED), within = clamp(block, ivec2(0), last);
    loaded[slot] = texelFetch(in_mask_guide, within, 0);
    nearest[slot] = texelFetch(in_mask_slope, within, 0).x;
    if (block == within) return;
    float mirrored = texelFetch(in_mask_guide, clamp(2 * within - block, ivec2(0), last), 0).w;
    loaded[slot].w = 2.0 * loaded[slot].w - mirrored;
}

// Weights of the Gaussian, its standard deviation in half-res px, normalised.
float weights[GAUSS + 1];

void place_weights(float sigma) {
    float sum = 0.0;
    for (int i = 0; i <= GAUSS; i++) {
        weights[i] = i == 0 ? 1.0 : exp(-0.5 * float(i * i) / max(sigma * sigma, 1e-4));
        sum += i == 0 ? 1.0 : 2.0 * weights[i];
    }
    for (int i = 0; i <= GAUSS; i++) weights[i] /= sum;
}

void smooth_block(int lane) {
    for (int slot = lane; slot < SMOOTH * LOADED; slot += 64) {
        int center = (slot / SMOOTH) * LOADED + slot % SMOOTH + GAUSS;
        vec4 sum = vec4(0.0);
        for (int i = -GAUSS; i <= GAUSS; i++) sum += weights[abs(i)] * loaded[center + i];
        rows[slot] = sum;
    }
    barrier();
    for (int slot = lane; slot < SMOOTH * SMOOTH; slot += 64) {
        int center = slot + GAUSS * SMOOTH;
        vec4 sum = vec4(0.0);
        for (int i = -GAUSS; i <= GAUSS; i++) sum += weights[abs(i)] * rows[center + i * SMOOTH];
        smoothed[slot] = sum;
    }
    barrier();
}

// Change per half-res px along `step` (1 or SMOOTH slots) of normal and CoC.
vec4 sobel(int center, int along, int across) {
    vec4 sum = vec4(0.0);
    for (int i = -2; i <= 2; i++) {
        if (i == 0) continue;
        for (int j = -2; j <= 2; j++) {
            sum += DERIVATIVE[i + 2] * SMOOTHING[j + 2] * smoothed[center + i * along + j * across];
        }
    }
    return sum / RAMP;
}

// The most negative CoC [px] in the tiles that the work group loads from.
float nearest_around() {
    ivec2 last = textureSize(in_tiles, 0) - 1;
    float lowest = 0.0;
    for (int i = 0; i < 9; i++) {
        ivec2 tile = clamp(ivec2(gl_WorkGroupID.xy) + ivec2(i % 3, i / 3) - 1, ivec2(0), last);
        lowest = min(lowest, texelFetch(in_tiles, tile, 0).x);
    }
    return lowest;
}

// Response and reach of the pixel as an edge; zero if it is none.
vec2 edge_at(ivec2 p, ivec2 local) {
    int center = (local.y + SOBEL) * SMOOTH + local.x + SOBEL;
    vec4 dx = sobel(center, 1, SMOOTH), dy = sobel(center, SMOOTH, 1);
    float dn = sqrt(dot(dx.xyz, dx.xyz) + dot(dy.xyz, dy.xyz));
    float dd = length(vec2(dx.w, dy.w) - texelFetch(in_mask_slope, p, 0).yz);
    float response = mask_response(dd + dn, frame.mask_sensitivity);
    // A line one pixel wide has its gradient beside it: an edge takes the nearest surface among its neighbours.
    float coc = 0.0;
    int first = (local.y + SOBEL + GAUSS - 1) * LOADED + local.x + SOBEL + GAUSS - 1;
    for (int i = 0; i < 9; i++) coc = min(coc, nearest[first + (i / 3) * LOADED + i % 3]);
    float reach = edge_reach_half(coc);
    return response >= frame.mask_threshold && response > 0.0 && reach > 0.0 ? vec2(response, reach) : vec2(0.0);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(p, imageSize(out_mask_edges)));
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) tile_reach = 0u;
    vec2 edge = vec2(0.0);
    if (nearest_around() < -RAYS_BEGIN_PX) {  // the same for the whole group
        ivec2 corner = 8 * ivec2(gl_WorkGroupID.xy) - (SOBEL + GAUSS);
        for (int slot = int(lane); slot < LOADED * LOADED; slot += 64) load(slot, corner);
        place_weights(0.5 * frame.mask_smoothing);
        barrier();
        smooth_block(int(lane));
        if (inside) edge = edge_at(p, ivec2(gl_LocalInvocationID.xy));
        // What is stored is what the tile must cover, so round as the float16 target does.
        if (edge.y > 0.0) atomicMax(tile_reach, floatBitsToUint(unpackHalf2x16(packHalf2x16(edge)).y));
        barrier();
    }
    if (inside) imageStore(out_mask_edges, p, vec4(edge, 0.0, 0.0));
    if (lane > 0u) return;
    imageStore(out_mask_tiles, ivec2(gl_WorkGroupID.xy), vec4(uintBitsToFloat(tile_reach)));
    if (tile_reach > 0u) atomicMax(largest_reach, tile_reach);
}
