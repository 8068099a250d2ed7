// Paints one target so that a person can read its values; a texel that is not a number or infinite is magenta, in
// every kind.
// Reads: color (the target's own unit and resolution; see app/frame/targets.py), frame.overlay_range_lo and _hi (that
//   unit), frame.exposure.
// Writes: display (full resolution, display values). A coarse target's texels are shown as blocks, unfiltered, since
//   they are what is inspected.
// Method: the colour maps of lib/colormap.glsl. SHOW: 0 colour, 1 signed, 2 scalar, 3 octahedral normal, 4 vector.
#include "lib/colormap.glsl"
#include "lib/octahedral.glsl"
#include "lib/tone.glsl"
#include "shared/frame.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_color;
layout(rgba8) uniform writeonly image2D out_display;

// Of up to three signed components the one farthest from zero: a tile's extremes, a colour's rounding error, or the
// only one there is.
float largest(vec3 v) {
    float xy = abs(v.x) >= abs(v.y) ? v.x : v.y;
    return abs(xy) >= abs(v.z) ? xy : v.z;
}

vec3 paint(vec4 value) {
    float low = frame.overlay_range_lo, high = frame.overlay_range_hi;
#if SHOW == 0
    return srgb_encode(clamp(value.rgb * frame.exposure, 0.0, 1.0));
#elif SHOW == 1
    return diverging(signed_unit(largest(value.rgb), low, high));
#elif SHOW == 2
    return sequential((value.r - low) / max(high - low, 1e-30));
#elif SHOW == 3
    return value.w > 0.0 ? 0.5 + 0.5 * octahedral_decode(value.xy) : vec3(0.0);
#else
    return wheel(value.x / max(high, 1e-30), value.y / max(high, 1e-30));
#endif
}

void main() {
    ivec2 size = imageSize(out_display), pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, size))) return;
    ivec2 available = textureSize(in_color, 0);
    vec4 value = texelFetch(in_color, min(pixel * available / size, available - 1), 0);
    bool valid = !(any(isnan(value)) || any(isinf(value)));
    imageStore(out_display, pixel, vec4(valid ? paint(value) : INVALID, 1.0));
}
