// Leaves the depth of what the sun sees, with the holes of alpha-masked materials.
// Reads: base colour textures of masked materials.
// Writes: the shadow map's depth only.
// Method: shadow mapping (Williams 1978).
#if ALPHA_MASKED
#include "shared/surface.glsl"

in vec2 v_uv;
flat in uint v_material;
#endif

void main() {
#if ALPHA_MASKED
    vec2 du = dFdx(v_uv), dv = dFdy(v_uv);
    float footprint_uv = sqrt(abs(du.x * dv.y - du.y * dv.x));  // orthographic: one map texel, in units of uv
    if (!alpha_passes(v_material, v_uv, footprint_uv)) discard;
#endif
}
