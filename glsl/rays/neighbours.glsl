// The pixels that may smooth a pixel's traced layers: how far they lie, and whether their blur reaches. For the passes
// of spatial reconstruction, which must agree about it.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/kernel.glsl"
#include "lib/reconstruct.glsl"

uniform sampler2D in_kernel;  // points of the aperture, half lens diameters
uniform sampler2D in_layer_state;
uniform sampler2D in_layer_coc;

float rays_of(vec4 state) {
    return min(state.x, state.y);
}

// CoC [px] of the near and of the far layer at p: its own hits', or those of the 3x3 pixels around where no ray hit
// one.
vec2 layer_coc(ivec2 p) {
    vec4 own = fetch_finite(in_layer_state, p);
    vec2 coc = fetch_finite(in_layer_coc, p).xy, sum = vec2(0.0), hits = vec2(1e-12);
    if (own.z > 0.0 && own.z < 1.0) return coc;
    ivec2 last = textureSize(in_layer_state, 0) - 1;
    for (int i = 0; i < 9; i++) {
        ivec2 texel = clamp(p + ivec2(i % 3, i / 3) - 1, ivec2(0), last);
        vec4 state = fetch_finite(in_layer_state, texel);
        vec2 share = rays_of(state) * vec2(state.z, 1.0 - state.z);
        sum += share * fetch_finite(in_layer_coc, texel).xy;
        hits += share;
    }
    return vec2(own.z > 0.0 ? coc.x : sum.x / hits.x, own.z < 1.0 ? coc.y : sum.y / hits.y);
}

// Radius [half-res px] over which each layer is gathered.
vec2 layer_radius(vec2 coc) {
    float share = frame.reconstruct_radius;
    return vec2(gather_radius_half(coc.x, share), gather_radius_half(coc.y, share));
}

// Offset [half-res px] of tap i; taps come in opposite pairs, so that what p takes from q, q takes from p.
ivec2 tap_offset(int i, int rings, float reach) {
    return ivec2(round(reach * texelFetch(in_kernel, ivec2(i, rings), 0).xy));
}

// Weight of a sample of `state` and CoC `coc` [px], `distance` full-res px away, for the near and the far layer of
// radius `radius` [half-res px]. A pixel without near hits has no near CoC; that it has none counts all the same.
vec2 tap_weight(vec4 state, vec2 coc, float distance, vec2 radius) {
    if (distance == 0.0) return vec2(1.0);
    vec2 within = vec2(lessThanEqual(vec2(distance), 2.0 * radius));
    return within * vec2(state.z > 0.0 ? reach_weight(coc.x, distance) : 1.0, reach_weight(coc.y, distance));
}
