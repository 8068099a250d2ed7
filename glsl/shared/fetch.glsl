// Reading targets so that one bad texel stays one bad texel: every pass fetches through these.
// What is not finite counts as nothing here; the health counter (measure/health.comp) tells that it was there.
#include "lib/finite.glsl"
#include "lib/coc.glsl"

// Any target: 0 in place of what is not finite.
vec4 fetch_finite(sampler2D target, ivec2 texel) {
    return finite(texelFetch(target, texel, 0));
}

// Light, coverage and shares: negative is 0, too.
vec4 fetch_light(sampler2D target, ivec2 texel) {
    return finite_radiance(texelFetch(target, texel, 0));
}

// Light in rgb beside a signed CoC in a.
vec4 fetch_sample(sampler2D target, ivec2 texel) {
    vec4 value = texelFetch(target, texel, 0);
    return vec4(finite_radiance(value).rgb, finite(value).a);
}

// Depth [m]: the sky where it is no surface's.
float fetch_depth(sampler2D target, ivec2 texel) {
    float depth = fetch_finite(target, texel).r;
    return depth > 0.0 ? min(depth, SKY_DEPTH) : SKY_DEPTH;
}
