// Low-discrepancy points: Owen-scrambled Sobol in four dimensions. Bit-exact twin and sources: app/sampling.py.

// Joe and Kuo 2008, first four dimensions; printed by app.sampling.sobol_directions.
const uvec4 SOBOL[32] = uvec4[32](
    uvec4(0x80000000u, 0x80000000u, 0x80000000u, 0x80000000u),
    uvec4(0x40000000u, 0xc0000000u, 0xc0000000u, 0xc0000000u),
    uvec4(0x20000000u, 0xa0000000u, 0x60000000u, 0x20000000u),
    uvec4(0x10000000u, 0xf0000000u, 0x90000000u, 0x50000000u),
    uvec4(0x08000000u, 0x88000000u, 0xe8000000u, 0xf8000000u),
    uvec4(0x04000000u, 0xcc000000u, 0x5c000000u, 0x74000000u),
    uvec4(0x02000000u, 0xaa000000u, 0x8e000000u, 0xa2000000u),
    uvec4(0x01000000u, 0xff000000u, 0xc5000000u, 0x93000000u),
    uvec4(0x00800000u, 0x80800000u, 0x68800000u, 0xd8800000u),
    uvec4(0x00400000u, 0xc0c00000u, 0x9cc00000u, 0x25400000u),
    uvec4(0x00200000u, 0xa0a00000u, 0xee600000u, 0x59e00000u),
    uvec4(0x00100000u, 0xf0f00000u, 0x55900000u, 0xe6d00000u),
    uvec4(0x00080000u, 0x88880000u, 0x80680000u, 0x78080000u),
    uvec4(0x00040000u, 0xcccc0000u, 0xc09c0000u, 0xb40c0000u),
    uvec4(0x00020000u, 0xaaaa0000u, 0x60ee0000u, 0x82020000u),
    uvec4(0x00010000u, 0xffff0000u, 0x90550000u, 0xc3050000u),
    uvec4(0x00008000u, 0x80008000u, 0xe8808000u, 0x208f8000u),
    uvec4(0x00004000u, 0xc000c000u, 0x5cc0c000u, 0x51474000u),
    uvec4(0x00002000u, 0xa000a000u, 0x8e606000u, 0xfbea2000u),
    uvec4(0x00001000u, 0xf000f000u, 0xc5909000u, 0x75d93000u),
    uvec4(0x00000800u, 0x88008800u, 0x6868e800u, 0xa0858800u),
    uvec4(0x00000400u, 0xcc00cc00u, 0x9c9c5c00u, 0x914e5400u),
    uvec4(0x00000200u, 0xaa00aa00u, 0xeeee8e00u, 0xdbe79e00u),
    uvec4(0x00000100u, 0xff00ff00u, 0x5555c500u, 0x25db6d00u),
    uvec4(0x00000080u, 0x80808080u, 0x8000e880u, 0x58800080u),
    uvec4(0x00000040u, 0xc0c0c0c0u, 0xc0005cc0u, 0xe54000c0u),
    uvec4(0x00000020u, 0xa0a0a0a0u, 0x60008e60u, 0x79e00020u),
    uvec4(0x00000010u, 0xf0f0f0f0u, 0x9000c590u, 0xb6d00050u),
    uvec4(0x00000008u, 0x88888888u, 0xe8006868u, 0x800800f8u),
    uvec4(0x00000004u, 0xccccccccu, 0x5c009c9cu, 0xc00c0074u),
    uvec4(0x00000002u, 0xaaaaaaaau, 0x8e00eeeeu, 0x200200a2u),
    uvec4(0x00000001u, 0xffffffffu, 0xc5005555u, 0x50050093u)
);

uint hash_u32(uint h) {
    h = (h ^ (h >> 16u)) * 0x21f0aaadu;
    h = (h ^ (h >> 15u)) * 0x735a2d97u;
    return h ^ (h >> 15u);
}

// One seed per pixel, unrelated between neighbours and between runs' seeds.
uint pixel_seed(uvec2 pixel, uint seed) {
    return hash_u32(pixel.x + hash_u32(pixel.y + hash_u32(seed)));
}

// A random base-2 digit scramble of 32-bit fractions, four at once (Laine and Karras 2011, section 3.1, with the better
// mixing constants of Vegdahl 2021).
uvec4 owen_scramble(uvec4 x, uvec4 seed) {
    uvec4 v = bitfieldReverse(x);
    v ^= v * 0x3d20adeau;
    v += seed;
    v *= (seed >> 16u) | 1u;
    v ^= v * 0x05526c56u;
    v ^= v * 0x53a22864u;
    return bitfieldReverse(v);
}

// Point `index` of the sequence scrambled by `seed`, in [0, 1): xy place a sample on the lens, zw within the pixel.
vec4 sobol4(uint index, uint seed) {
    uvec4 bits = uvec4(0u);
    for (uint bit = 0u; index != 0u; ++bit, index >>= 1u) {
        if ((index & 1u) != 0u) bits ^= SOBOL[bit];
    }
    uvec4 seeds = uvec4(hash_u32(seed), hash_u32(seed + 1u), hash_u32(seed + 2u), hash_u32(seed + 3u));
    return vec4(owen_scramble(bits, seeds) >> 8u) * (1.0 / 16777216.0);
}
