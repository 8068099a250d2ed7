// Lays the traced near layer over what lies behind it, and leaves everything outside the ray mask to the post-process.
// Reads: lit (radiance), coc (px), post (radiance; a: specular luminance of its near layer), full resolution; far_blur
//   (radiance; a: validity), mask (y: weight of rays), near_smooth, far_smooth (premultiplied; a: share of light) or,
//   without spatial reconstruction, near_light, far_light (likewise), layer_state (z: hit ratio; w: 0 where nothing is
//   held), half resolution.
// Writes: hybrid (radiance; a: share of the traced near layer, which moves otherwise than the surface behind it), full
//   resolution.
// Method: poster, 2.3. Inside the mask, near + (1 - hit ratio) * behind. Behind is the sharp raster image where that
// is in focus, so that it keeps full resolution; else the traced far layer, which gives way to the post-process where
// almost all rays hit near. Bright specular bokeh of near surfaces stays the post-process'. The mask's feather hides
// its edge.
#include "shared/frame.glsl"
#include "lib/coc.glsl"
#include "lib/hit_layers.glsl"
#include "lib/splat.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_coc;
uniform sampler2D in_post;
uniform sampler2D in_post_behind;
uniform sampler2D in_far_blur;
uniform sampler2D in_mask;
#if HAS_NEAR_SMOOTH && HAS_FAR_SMOOTH
uniform sampler2D in_near_smooth;
uniform sampler2D in_far_smooth;
#define NEAR in_near_smooth
#define FAR in_far_smooth
#else
uniform sampler2D in_near_light;
uniform sampler2D in_far_light;
#define NEAR in_near_light
#define FAR in_far_light
#endif
uniform sampler2D in_layer_state;
layout(rgba16f) uniform writeonly image2D out_hybrid;

// The traced layers at a full-res pixel.
struct Traced {
    vec4 near;    // premultiplied; a: share of light that it holds back from what lies behind
    vec4 far;     // premultiplied; a: 1 - near.a
    float ratio;  // hit ratio, accumulated
    float held;   // 0..1: part of the pixel's neighbourhood that holds any
};

Traced traced_at(vec2 half_position) {
    ivec2 last = textureSize(in_layer_state, 0) - 1, corner = ivec2(floor(half_position - 0.5));
    vec2 f = half_position - 0.5 - vec2(corner);
    Traced sum = Traced(vec4(0.0), vec4(0.0), 0.0, 0.0);
    for (int i = 0; i < 4; i++) {
        ivec2 step = ivec2(i & 1, i >> 1), texel = clamp(corner + step, ivec2(0), last);
        vec2 bilinear = mix(1.0 - f, f, vec2(step));
        vec4 state = texelFetch(in_layer_state, texel, 0);
        float w = state.w > 0.0 ? bilinear.x * bilinear.y : 0.0;
        if (w == 0.0) continue;
        sum.near += w * texelFetch(NEAR, texel, 0);
        sum.far += w * texelFetch(FAR, texel, 0);
        sum.ratio += w * state.z;
        sum.held += w;
    }
    float total = max(sum.near.a + sum.far.a, 1e-6);
    return Traced(sum.near / total, sum.far / total, sum.ratio / max(sum.held, 1e-6), sum.held);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(out_hybrid)))) return;
    vec4 post = texelFetch(in_post, pixel, 0);
    vec2 half_position = 0.5 * (vec2(pixel) + 0.5), uv = half_position / vec2(textureSize(in_mask, 0));
    float feather = textureLod(in_mask, uv, 0.0).y;
    Traced traced = Traced(vec4(0.0), vec4(0.0), 0.0, 0.0);
    if (feather > 0.0) traced = traced_at(half_position);
    if (traced.held == 0.0) {
        imageStore(out_hybrid, pixel, vec4(post.rgb, 0.0));
        return;
    }
    // Weights come from accumulated values only: the picture is linear in this frame's rays, and its mean unbiased.
    vec4 post_far = textureLod(in_far_blur, uv, 0.0);
    float open = 1.0 - traced.near.a;
    float filtered = post_far_share(traced.ratio, frame.blend_hit_ratio) * post_far.a;
    float coc = texelFetch(in_coc, pixel, 0).r;
    float rasterised = float(RASTER_FOCUS) * raster_share(coc, IN_FOCUS_COC_PX, frame.focus_blend);
    vec3 behind = mix(traced.far.rgb, open * post_far.rgb, filtered);
    behind = mix(behind, open * texelFetch(in_post_behind, pixel, 0).rgb, rasterised);
    float rays = feather * (1.0 - post_near_share(post.a, frame.blend_specular));
    vec3 color = mix(post.rgb, traced.near.rgb + behind, rays);
    imageStore(out_hybrid, pixel, vec4(color, rays * clamp(traced.near.a, 0.0, 1.0)));
}
