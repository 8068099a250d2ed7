// Asks whether what the traced layers remember is still true: traces stored lens rays of the last frame again.
// Reads: trace_motion (px), trace_near, trace_far (a: share of rays), ray_count (x: rays), half resolution; last
//   frame's probe_hit (world position, m; compressed luminance) and probe_lens (lens point; object; 1 + near share),
//   one texel per 3x3 half-res px; the scene and its ray-tracing tree.
// Writes: gradient (x: near, y: far; squared relative change 0..1, -1 where no ray tells), one texel per 3x3 half-res
//   px.
// Method: Schied, Peters and Dachsbacher 2018, with lens rays for their surface samples: the stored hit moves with its
// object, and the ray from the same lens point through it, as the camera is now, must bring the same light. It does
// unless something came between or the light changed, so a still world under a moving camera has no gradient.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/color.glsl"
#include "lib/gradient.glsl"
#include "rays/lens_ray.glsl"
#include "rays/hit.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_trace_motion;
uniform sampler2D in_trace_near;
uniform sampler2D in_trace_far;
uniform sampler2D in_ray_count;
uniform sampler2D prev_probe_hit;
uniform sampler2D prev_probe_lens;
layout(rg16f) uniform writeonly image2D out_gradient;

// Where a point of an object that was at `before` is now [m].
vec3 position_now(uint object, vec3 before) {
#if OBJECTS
    if (object > 0u) return (inverse(object_at(object).to_previous) * vec4(before, 1.0)).xyz;
#endif
    return before;
}

// The ray from a point of the lens to a point of the world; view depth 1, so that t is planar depth.
Ray ray_to(vec3 position, vec2 lens) {
    vec2 offset = 0.5 * frame.aperture * aperture_sample(lens);
    vec3 origin = (frame.view_to_world * vec4(offset, 0.0, 1.0)).xyz;
    vec3 to = position - origin;
    return Ray(origin, to / max(-(mat3(frame.view) * to).z, frame.near_plane), frame.near_plane);
}

// Mean screen motion of the block's near (xy) and far (zw) hits [px]; no rays: `held` is false.
vec4 block_motion(ivec2 block, out bool held) {
    vec4 motion = vec4(0.0), shares = vec4(0.0);
    ivec2 last = textureSize(in_ray_count, 0) - 1;
    for (int i = 0; i < 9; i++) {
        ivec2 p = min(3 * block + ivec2(i % 3, i / 3), last);
        float rays = fetch_finite(in_ray_count, p).x;
        if (rays == 0.0) continue;
        vec4 share = rays * vec4(fetch_light(in_trace_near, p).aa, fetch_light(in_trace_far, p).aa);
        motion += share * fetch_finite(in_trace_motion, p);
        shares += share;
    }
    held = shares.x + shares.z > 0.0;
    motion /= max(shares, 1e-12);
    if (shares.x == 0.0) motion.xy = motion.zw;
    if (shares.z == 0.0) motion.zw = motion.xy;
    return motion;
}

// Change of the light of the ray stored in a block, if it belongs to the layer asked for; -1: no such ray.
float change_at(ivec2 block, bool near) {
    if (any(lessThan(block, ivec2(0))) || any(greaterThanEqual(block, textureSize(prev_probe_hit, 0)))) return -1.0;
    vec4 lens = fetch_finite(prev_probe_lens, block);
    if (lens.w == 0.0 || (lens.w >= 1.5) != near) return -1.0;
    vec4 hit = fetch_finite(prev_probe_hit, block);
    float depth;
    vec3 position;
    uint object = uint(lens.z);
    vec4 color = radiance(ray_to(position_now(object, hit.xyz), lens.xy), depth, position, object);
    return light_change(hit.w, compressed_luminance(mix(vec3(0.0), color.rgb, usable(color.rgb))));
}

void main() {
    ivec2 block = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(block, imageSize(out_gradient)))) return;
    bool held;
    vec4 motion = block_motion(block, held);
    vec2 change = vec2(-1.0);
    if (held && frame.history_valid != 0u) {
        vec2 center = vec2(3 * block) + 1.5;
        change.x = change_at(ivec2(floor((center - 0.5 * motion.xy) / 3.0)), true);
        change.y = change_at(ivec2(floor((center - 0.5 * motion.zw) / 3.0)), false);
    }
    imageStore(out_gradient, block, vec4(change, 0.0, 0.0));
}
