// Colour arithmetic. Float64 twins: tests/gpu/shading_twin.py.

// Relative luminance of linear sRGB primaries (Rec. ITU-R BT.709-6).
float luminance(vec3 rgb) {
    return dot(rgb, vec3(0.2126, 0.7152, 0.0722));
}

// Luminance brought into 0..1 (Reinhard et al. 2002): what a small bright light adds to the statistics of noise is what
// a viewer may see of it. The pivot is display white.
float compressed_luminance(vec3 rgb) {
    float light = luminance(rgb);
    return light / (1.0 + light);
}

// Luma and two chroma differences: axes along which neighbouring colours spread most and least (Malvar and Sullivan
// 2003).
vec3 ycocg_from_rgb(vec3 c) {
    return vec3(dot(c, vec3(0.25, 0.5, 0.25)), 0.5 * (c.r - c.b), dot(c, vec3(-0.25, 0.5, -0.25)));
}

vec3 rgb_from_ycocg(vec3 c) {
    return vec3(c.x + c.y - c.z, c.x + c.z, c.x - c.y - c.z);
}
