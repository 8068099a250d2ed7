// How wrong a pixel is beside the true one. Float64 twin: squared_errors in app/measure/metrics.py.
#include "lib/tone.glsl"

const float RELATIVE_EPSILON = 0.01;  // keeps black pixels from deciding a mean (Rousselle, Knaus and Zwicker 2011)

vec3 shown(vec3 light) {
    return srgb_encode(clamp(light, 0.0, 1.0));
}

// Means over the channels of two linear colours. x: squared error; y: relative squared error; z: squared error as
// displayed by default (clipped, sRGB-encoded).
vec3 squared_errors(vec3 light, vec3 truth) {
    vec3 off = light - truth, seen = shown(light) - shown(truth), third = vec3(1.0 / 3.0);
    float relative = dot(off * off / (truth * truth + RELATIVE_EPSILON), third);
    return vec3(dot(off * off, third), relative, dot(seen * seen, third));
}
