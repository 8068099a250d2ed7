// Smooths the noise of few rays: each traced layer is gathered from neighbours whose blur reaches the pixel.
// Reads: near_light, far_light (premultiplied; a: share of light), layer_state (x, y: rays; z: hit ratio; w: 0 where
//   nothing is held), layer_coc (px; near, far), layer_smoothing (how much of each layer is noise, 0..1), half
//   resolution.
// Writes: near_smooth, far_smooth (as near_light and far_light), half resolution.
// Over: the tiles with rays of RayTiles; elsewhere what it writes is 0.
// Method: poster, 2.2: a circular gather scaled by CoC, here one radius a layer, so that what is in focus behind blur
// stays sharp. Samples whose CoC is smaller than their distance are rejected. Two pixels exchange as much as the less
// noisy one of them may give and take: light only moves, none is made or lost, and converged regions stay as they are.
// Rings lie at most two texels apart and turn each frame, so the finest level of detail serves. The kernel is the whole
// aperture's: where the barrel narrows the lens, a tap that lies outside still tells of the same layers' light.
#include "rays/neighbours.glsl"
#include "dof/ray_tiles.glsl"
#include "dof/listed_tile.glsl"

layout(local_size_x = 8, local_size_y = 8) in;  // one tile
uniform sampler2D in_near_light;
uniform sampler2D in_far_light;
uniform sampler2D in_layer_smoothing;
layout(rgba16f) uniform writeonly image2D out_near_smooth;
layout(rgba16f) uniform writeonly image2D out_far_smooth;

const float FEWEST_SHARE = 1e-4;  // below any hit of one ray in thousands: no light to tell a layer's colour from

// How much the far layer may grow to fill what the near one leaves open: more than different smoothing ever asks for,
// and little enough that the share of a few rays, near none, does not turn their light into a spark.
const float MOST_FILL = 2.0;

// Lets the layers of the pixel exchange light with its neighbours. A pixel of a wide kernel has its taps farther apart
// and meets each neighbour more rarely: one of a narrow kernel waits for it.
void exchange(ivec2 p, vec4 state, inout vec4 near, inout vec4 far) {
    vec4 own = fetch_finite(in_layer_smoothing, p);
    vec2 coc = fetch_finite(in_layer_coc, p).xy;
    float reach = max(own.z, own.w);
    int rings = ring_count(reach, RINGS), taps = kernel_taps(rings);
    vec4 near_sum = vec4(0.0), far_sum = vec4(0.0);
    ivec2 last = textureSize(in_layer_state, 0) - 1;
    for (int i = 1; i < taps; i++) {
        ivec2 offset = tap_offset(i, rings, reach), texel = p + offset;
        if (offset == ivec2(0) || texel != clamp(texel, ivec2(0), last)) continue;
        vec4 there = fetch_finite(in_layer_state, texel), other = fetch_finite(in_layer_smoothing, texel);
        if (there.w == 0.0) continue;
        float distance = 2.0 * length(vec2(offset)), rarity = reach / max(reach, max(other.z, other.w));
        vec2 radius = min(own.zw, other.zw);
        vec2 weight = min(tap_weight(there, fetch_finite(in_layer_coc, texel).xy, distance, radius),
                          tap_weight(state, coc, distance, radius));
        weight *= rarity * rarity * min(own.xy, other.xy);
        near_sum += weight.x * (fetch_finite(in_near_light, texel) - near);
        far_sum += weight.y * (fetch_finite(in_far_light, texel) - far);
    }
    near += near_sum / float(taps);
    far += far_sum / float(taps);
}

// The far light of the 3x3 pixels around, for a pixel whose few rays all missed it.
vec4 far_around(ivec2 p) {
    vec4 far = vec4(0.0);
    ivec2 last = textureSize(in_layer_state, 0) - 1;
    for (int i = 0; i < 9; i++) {
        far += fetch_finite(in_far_light, clamp(p + ivec2(i % 3, i / 3) - 1, ivec2(0), last));
    }
    return far;
}

void main() {
    ivec2 tile = listed_tile(), p = texel_of(tile, 8);
    if (tile.x < 0 || any(greaterThanEqual(p, imageSize(out_near_smooth)))) return;
    vec4 near = fetch_finite(in_near_light, p), far = fetch_finite(in_far_light, p);
    vec4 state = fetch_finite(in_layer_state, p);
    if (state.w > 0.0) {
        exchange(p, state, near, far);
        // The layers cover the pixel together: the far one fills what the near one leaves open.
        if (far.a < FEWEST_SHARE) far = far_around(p);
        if (far.a < FEWEST_SHARE) near /= max(near.a, FEWEST_SHARE);
        far *= far.a < FEWEST_SHARE ? 0.0 : clamp((1.0 - near.a) / far.a, 0.0, MOST_FILL);
    }
    imageStore(out_near_smooth, p, within_half(near));
    imageStore(out_far_smooth, p, within_half(far));
}
