// What a change of light means for history. Float64 twins: tests/gpu/hybrid_twin.py.

const float DARK = 1e-3;  // compressed luminance below which no change shows: a third of an 8-bit step of display white

// Squared relative change of light, 0..1 (Schied, Peters and Dachsbacher 2018; squaring keeps small changes small).
float light_change(float before, float now) {
    float change = abs(now - before) / max(max(before, now), DARK);
    return min(change * change, 1.0);
}

// Part of the blur over which the motions of one layer's hits may drift apart before its history is stale.
const float DRIFT = 0.5;

// Smallest weight of the newest rays: `least`, more where light changed, and where the hits' motions differ by `drift`
// px a frame, so that no frame counts that lies apart by a good part of the blur of radius `coc` px.
float stale_weight(float least, float change, float drift, float coc) {
    float apart = min(drift / (DRIFT * max(abs(coc), 1.0)), 1.0);
    return max(mix(least, 1.0, clamp(change, 0.0, 1.0)), apart);
}
