// Circle of confusion of the thin lens. The derivation and the float64 twin are in app/optics.py.

const float SKY_DEPTH = 1e9;  // m; depth where nothing is. Finite, so that no filter meets an infinity
const float IN_FOCUS_COC_PX = 0.70710678;  // radius of the focus zone: a diameter below sqrt(2) px (poster, 2.3)

// Signed CoC radius [px] at planar depth z [m], negative in front of the focal plane; k = A H / (4 tan(fov/2)) [px m].
float coc_px(float z, float k, float inverse_focus) {
    return k * (inverse_focus - 1.0 / z);
}
