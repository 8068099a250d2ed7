// A running mean in float32 that keeps converging: compensated addition of (x - mean) / n (Kahan 1965).
// Float64 twin: tests/gpu/test_running_mean.py.
#include "lib/finite.glsl"

// mean.rgb over mean.a samples takes one more; `withheld` carries the rounding between calls. What is not finite
// counts as black.
void add_sample(inout vec4 mean, inout vec3 withheld, vec3 value) {
    value = mix(vec3(0.0), value, usable(value));
    mean.a += 1.0;
    precise vec3 step = (value - mean.rgb) / mean.a - withheld;
    precise vec3 moved = mean.rgb + step;
    precise vec3 taken = moved - mean.rgb;
    precise vec3 lost = taken - step;
    withheld = lost;
    mean.rgb = moved;
}
