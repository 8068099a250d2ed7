// Turns the finished picture into display values.
// Reads (full resolution): color (radiance, linear), coc (signed radius, px; FOCUS_PLANE only), backdrop (radiance of
//   the sharp raster image, which stands in for pixels of a running mean that have no sample yet; BACKDROP only).
// Writes: display (sRGB-encoded, 8 bit, full resolution).
// Method: exposure, a tone curve (lib/tone.glsl), the sRGB transfer function (IEC 61966-2-1).
#include "shared/frame.glsl"
#include "shared/fetch.glsl"
#include "lib/tone.glsl"
#include "lib/coc.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D in_color;
layout(rgba8) uniform writeonly image2D out_display;
#if FOCUS_PLANE
uniform sampler2D in_coc;
const vec3 FOCUS_TINT = vec3(0.1, 0.9, 0.4);  // green: rare in interiors, kept readable by tinting half way
#endif
#if BACKDROP
uniform sampler2D in_backdrop;
#endif

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, ivec2(frame.size_px)))) return;
    vec4 color = fetch_light(in_color, p);
#if BACKDROP
    if (color.a == 0.0) color = fetch_light(in_backdrop, p);
#endif
    vec3 light = max(color.rgb, 0.0) * frame.exposure;
#if TONE_MAP == 1
    light = tone_aces(light);
#elif TONE_MAP == 2
    light = tone_neutral(light);
#endif
    vec3 shown = srgb_encode(clamp(light, 0.0, 1.0));
#if FOCUS_PLANE
    if (abs(fetch_finite(in_coc, p).r) < IN_FOCUS_COC_PX) shown = mix(shown, FOCUS_TINT, 0.5);
#endif
    imageStore(out_display, p, vec4(shown, 1.0));
}
