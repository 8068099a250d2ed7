// Counts the texels of a target that no pass should have made: not finite, or negative where it holds none such.
// Reads: target (any). Writes: Health: texels with a component that is not finite, and others with a negative one.
// Method: one invocation a texel, added up in shared memory first. Decided on the bits, as lib/finite.glsl does.

layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D in_target;
uniform uvec4 unsigned_components;  // 1: negative is a fault
layout(std430) buffer Health { uint non_finite; uint negative; };

shared uint counted[2];

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (gl_LocalInvocationIndex < 2u) counted[gl_LocalInvocationIndex] = 0u;
    barrier();
    if (all(lessThan(texel, textureSize(in_target, 0)))) {
        uvec4 bits = floatBitsToUint(texelFetch(in_target, texel, 0)), size = bits & 0x7fffffffu;
        bool bad = any(greaterThanEqual(size, uvec4(0x7f800000u)));
        // -0 is no negative number.
        bool below = any(notEqual(unsigned_components * (bits >> 31u) * min(size, uvec4(1u)), uvec4(0u)));
        if (bad) atomicAdd(counted[0], 1u);
        else if (below) atomicAdd(counted[1], 1u);
    }
    barrier();
    if (gl_LocalInvocationIndex > 0u) return;
    if (counted[0] > 0u) atomicAdd(non_finite, counted[0]);
    if (counted[1] > 0u) atomicAdd(negative, counted[1]);
}
