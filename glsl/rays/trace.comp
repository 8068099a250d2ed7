// Traces the lens rays of the listed pixels and sorts what they hit into the near and the far layer.
// Reads: RayWork (pixels as x | y << 16), ray_count (x: rays, y: index of the first sample), half resolution.
// Writes: trace_near (radiance times hit ratio; a: hit ratio), trace_far (radiance times the rest; a: the rest),
//   trace_motion (xy: mean screen motion of near hits since last frame, zw: of far hits, px), trace_spread (mean CoC of
//   near and of far hits, px; mean square of their motion, px^2), trace_moments (mean over rays of x: near share times
//   compressed luminance, y: times its square, zw: of the rest), half resolution, listed pixels only; probe_hit,
//   probe_lens (one ray of every 3x3 pixels, kept to be traced again: gradient.comp).
// Method: distribution ray tracing over lens and pixel block (Cook, Porter and Carpenter 1984); near and far by
// signed CoC with a smooth band (poster, 2.1). One invocation sums one pixel's rays in order, so that the sum is the
// same in every run.
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/sampling.glsl"
#include "lib/hit_layers.glsl"
#include "lib/color.glsl"
#include "lib/work_list.glsl"
#include "rays/lens_ray.glsl"
#include "rays/hit.glsl"

layout(local_size_x = 64) in;
uniform sampler2D in_ray_count;
layout(rgba16f) uniform writeonly image2D out_trace_near;
layout(rgba16f) uniform writeonly image2D out_trace_far;
layout(rgba16f) uniform writeonly image2D out_trace_motion;
layout(rgba32f) uniform writeonly image2D out_trace_spread;
layout(rgba32f) uniform writeonly image2D out_trace_moments;
#if HAS_PROBE_HIT
layout(rgba32f) uniform writeonly image2D out_probe_hit;
layout(rgba32f) uniform writeonly image2D out_probe_lens;
#endif
layout(std430) readonly buffer RayWork { uint groups[3]; uint pixel_count; uint pixels[]; };

// Full-res pixel position of a world point; the point lies in front of this frame's camera, but perhaps not of the
// last frame's.
vec2 screen_px(mat4 view_proj, vec3 position) {
    vec4 clip = view_proj * vec4(position, 1.0);
    return (0.5 + 0.5 * clip.xy / max(clip.w, 1e-6)) * frame.size_px;
}

// Since last frame, of a point of a moving object (0: of what stands still).
vec2 motion_px(vec3 position, uint object) {
    vec3 before = previous_position(object, position);
    vec2 moved = screen_px(frame.this_view_proj, position) - screen_px(frame.prev_view_proj, before);
    return clamp(moved, -2.0 * frame.size_px, 2.0 * frame.size_px);  // behind last frame's camera: off its screen
}

// Keeps a ray for the next frame if its pixel is the one of its 3x3 whose turn it is.
void store_probe(uvec2 p, vec3 position, float light, vec2 lens, uint object, float share) {
#if HAS_PROBE_HIT
    uvec2 block = p / 3u, place = p - 3u * block;
    if (place.x + 3u * place.y != hash_u32(block.x + (block.y << 16u) + frame.frame_index * 0x9e3779b9u) % 9u) return;
    imageStore(out_probe_hit, ivec2(block), vec4(position, light));
    imageStore(out_probe_lens, ivec2(block), vec4(lens, float(object), 1.0 + share));
#endif
}

void main() {
    uint item = item_of(gl_WorkGroupID.xy, gl_LocalInvocationIndex);
    if (item >= pixel_count) return;
    uvec2 p = uvec2(pixels[item] & 0xffffu, pixels[item] >> 16u);
    vec2 count = fetch_finite(in_ray_count, ivec2(p)).xy;
    uint seed = pixel_seed(p, frame.seed), first = uint(count.y), rays = uint(count.x);
    vec4 near = vec4(0.0), far = vec4(0.0), motion = vec4(0.0), moments = vec4(0.0);
    vec2 circle = vec2(0.0), motion2 = vec2(0.0);
    for (uint i = 0u; i < rays; ++i) {
        vec4 s = sobol4(first + i, seed);
        vec2 pixel_px = 2.0 * (vec2(p) + s.zw), lens = lens_sample(pixel_px, s.xy, first + i, seed);
        float depth;
        vec3 position;
        uint object;
        vec3 seen = radiance(lens_ray(pixel_px, lens), depth, position, object).rgb;
        vec4 color = finite_radiance(vec4(seen, 1.0));
        float coc = coc_px(depth, frame.coc_scale_px, frame.inverse_focus);
        float share = near_share(coc, IN_FOCUS_COC_PX, frame.focus_blend);
        near += share * color;
        far += (1.0 - share) * color;
        float light = compressed_luminance(color.rgb);
        circle += vec2(share, 1.0 - share) * coc;
        moments += vec4(share, share, 1.0 - share, 1.0 - share) * vec2(light, light * light).xyxy;
        if (frame.moved != 0u) {
            vec2 moved = motion_px(position, object);
            motion += vec4(share, share, 1.0 - share, 1.0 - share) * moved.xyxy;
            motion2 += vec2(share, 1.0 - share) * dot(moved, moved);
        }
        if (i == 0u) store_probe(p, position, light, lens, object, share);
    }
    vec2 hits = max(vec2(near.a, far.a), 1e-6);
    motion /= hits.xxyy;
    imageStore(out_trace_near, ivec2(p), near / float(max(rays, 1u)));
    imageStore(out_trace_far, ivec2(p), far / float(max(rays, 1u)));
    imageStore(out_trace_motion, ivec2(p), motion);
    imageStore(out_trace_spread, ivec2(p), vec4(circle / hits, motion2 / hits));
    imageStore(out_trace_moments, ivec2(p), moments / float(max(rays, 1u)));
}
