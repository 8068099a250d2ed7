// Averages a view's picture over frames: everything while nothing moves, else what can be followed.
// Reads (full resolution): color (linear radiance, aliased, jittered; LAYERED a: share of a near layer), motion (px)
//   while something moves, last frame's resolved (linear radiance; a: frames averaged so far).
// Writes (full resolution): resolved (the same); while nothing moves in place, texel by texel over last frame's.
// Method: temporal anti-aliasing (Yang, Liu and Salvi 2020, sections 3 and 4): running mean; history fetched along
// motion with Catmull-Rom weights, since bilinear fetches blur a little more every frame, and clipped to the
// neighbourhood's mean and deviation (Salvi 2016).
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/color.glsl"
#include "lib/catmull_rom.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_color;
#if HAS_MOTION
uniform sampler2D prev_resolved;
uniform sampler2D in_motion;
layout(rgba32f) writeonly uniform image2D out_resolved;
#else
layout(rgba32f) uniform image2D out_resolved;
#endif

const float LAYERED_FRAMES = 1.0;   // earlier frames that count where a near layer lies over the surface that moves
const float CLIP_DEVIATIONS = 1.25;  // Salvi's gamma: 1 flickers on thin detail, 2 lets ghosts through

vec3 color_at(ivec2 pixel) {
    vec3 color = fetch_finite(in_color, clamp(pixel, ivec2(0), ivec2(frame.size_px) - 1)).rgb;
    return is_usable(color) ? clamp(color, -LARGEST_RADIANCE, LARGEST_RADIANCE) : vec3(0.0);
}

#if HAS_MOTION
// The history's colour pulled towards what this frame's neighbourhood makes plausible.
vec3 clipped_to_neighbourhood(vec3 history, ivec2 pixel) {
    vec3 sum = vec3(0.0), sum_of_squares = vec3(0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            vec3 c = ycocg_from_rgb(color_at(pixel + ivec2(x, y)));
            sum += c;
            sum_of_squares += c * c;
        }
    }
    vec3 mean = sum / 9.0;
    vec3 reach = CLIP_DEVIATIONS * sqrt(max(sum_of_squares / 9.0 - mean * mean, 0.0));
    return max(rgb_from_ycocg(clip_to_box(ycocg_from_rgb(history), mean, reach)), 0.0);  // black may round below
}

// Catmull-Rom over 4x4 texels in nine bilinear fetches (Jimenez 2016, slide 77).
vec4 history_at(vec2 position_px) {
    vec2 base = floor(position_px - 0.5) + 0.5;
    vec2 f = position_px - base;
    vec2 w0, w12, w3, offset12;
    catmull_rom_weights(f, w0, w12, w3, offset12);
    vec2 p0 = (base - 1.0) * frame.inverse_size;
    vec2 p12 = (base + offset12) * frame.inverse_size;
    vec2 p3 = (base + 2.0) * frame.inverse_size;
    vec4 sum = textureLod(prev_resolved, p0, 0.0) * (w0.x * w0.y)
             + textureLod(prev_resolved, vec2(p12.x, p0.y), 0.0) * (w12.x * w0.y)
             + textureLod(prev_resolved, vec2(p3.x, p0.y), 0.0) * (w3.x * w0.y)
             + textureLod(prev_resolved, vec2(p0.x, p12.y), 0.0) * (w0.x * w12.y)
             + textureLod(prev_resolved, p12, 0.0) * (w12.x * w12.y)
             + textureLod(prev_resolved, vec2(p3.x, p12.y), 0.0) * (w3.x * w12.y)
             + textureLod(prev_resolved, vec2(p0.x, p3.y), 0.0) * (w0.x * w3.y)
             + textureLod(prev_resolved, vec2(p12.x, p3.y), 0.0) * (w12.x * w3.y)
             + textureLod(prev_resolved, p3, 0.0) * (w3.x * w3.y);
    return max(sum, 0.0);
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px)))) return;
    vec3 now = color_at(pixel);
    bool known = frame.history_valid != 0u;
#if HAS_MOTION
    vec4 history = vec4(0.0);
    vec2 before = vec2(pixel) + 0.5 - fetch_finite(in_motion, pixel).xy;
    known = known && all(greaterThan(before, vec2(0.0))) && all(lessThan(before, frame.size_px));
    if (known) {
        history = history_at(before);
        history.rgb = clipped_to_neighbourhood(history.rgb, pixel);
        // What was reprojected counts for no more frames than keep the newest one's weight at taa_alpha.
        float most = 1.0 / frame.taa_alpha - 1.0;
#if LAYERED
        // The traced near layer has had its own history, along its own motion: here it would only leave a trail.
        most = mix(most, LAYERED_FRAMES, clamp(fetch_finite(in_color, pixel).a, 0.0, 1.0));
#endif
        history.a = min(history.a, most);
    }
#else
    vec4 history = finite(imageLoad(out_resolved, pixel));
#endif
    float frames = known && is_usable(history.rgb) ? history.a : 0.0;
    vec3 mean = frames > 0.0 ? history.rgb + (now - history.rgb) / (frames + 1.0) : now;
    imageStore(out_resolved, pixel, vec4(mean, frames + 1.0));
}
