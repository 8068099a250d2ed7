// The gather kernel: a centre tap and rings of 8, 16, 24, ... taps, each tap standing for the same area of the aperture
// (Jimenez 2014). Float64 twins: tests/gpu/post_twin.py.
#include "lib/lens.glsl"

const int MOST_RINGS = 8;             // that a kernel may have
const int UNTURNED = MOST_RINGS + 1;  // rows of the target `kernel` before those of frame 0's kernels
const int RIM_POINTS = 16;            // evenly by area swept: enough for a centroid

const float GOLDEN = 0.618033989;   // turns of the golden angle: successive rotations never repeat
const float ROOT = 0.414213562;     // sqrt(2) - 1: independent of GOLDEN and of the jitter's step (app/sampling.py: r2)

// Rings for a kernel of `radius_texels`: rings about a texel apart, `most` at the most.
int ring_count(float radius_texels, int most) {
    return clamp(int(ceil(radius_texels - 0.5)), 1, most);
}

// Outer rim of ring k of n (k = 0: the centre tap), as a fraction of the kernel's radius.
float ring_rim(int k, int n) {
    return (float(k) + 0.5) / (float(n) + 0.5);
}

// Taps of ring k; of a kernel of n rings; and the index of ring k's first. 1 + 8 + 16 + ... are the odd squares.
int ring_taps(int k) { return k == 0 ? 1 : 8 * k; }
int kernel_taps(int n) { return (2 * n + 1) * (2 * n + 1); }
int first_tap(int k) { return k == 0 ? 0 : kernel_taps(k - 1); }

// Point of the aperture (unit half diameter) at `turn` of the way round and enclosed-area fraction `area`, uniform by
// area in both.
vec2 aperture_point(float turn, float area, int blades, float rotation, float anamorphic) {
    float angle = 2.0 * PI * turn;
    vec2 point = sqrt(area) * vec2(cos(angle), sin(angle));
    if (blades >= 3) point = polygon_point(vec2(fract(turn), area), blades, rotation);
    return vec2(point.x / anamorphic, point.y);
}

// The gauge of ring k's taps in frame `index_of_frame`: 0 in the aperture's centre, 1 on its rim. Frames move a ring
// within its own area.
float tap_gauge(int k, int n, uint index_of_frame) {
    if (k == 0) return 0.0;
    float inner = ring_rim(k - 1, n), outer = ring_rim(k, n);
    return sqrt(mix(inner * inner, outer * outer, fract(0.5 + float(index_of_frame & 1023u) * GOLDEN)));
}

// Where in the aperture tap `index` of a kernel of n rings samples in frame `index_of_frame`: each frame turns the
// rings and moves them within their own area, so that the mean over frames fills the aperture evenly.
vec2 kernel_tap(int index, int n, uint index_of_frame, int blades, float rotation, float anamorphic) {
    if (index == 0) return vec2(0.0);
    // index lies between the squares of 2k - 1 and 2k + 1; + 0.5 keeps it clear of rounding.
    int k = int((1.0 + sqrt(float(index) + 0.5)) * 0.5);
    float frame = float(index_of_frame & 1023u);  // exact in float, and fract() of its multiples keeps its bits
    float turn = (float(index - first_tap(k)) + fract(float(k) * GOLDEN + frame * ROOT)) / float(ring_taps(k));
    float gauge = tap_gauge(k, n, index_of_frame);
    return aperture_point(turn, gauge * gauge, blades, rotation, anamorphic);
}
