// How sparse the gather's kernel is, for the passes that make up for it.

// Distance of neighbouring rings of a kernel of `radius`, in the radius' unit.
float ring_spacing(float radius) {
    return radius / (float(RINGS) + 0.5);
}

// Radius [px] of the prefilter for a CoC [px]: one ring spacing, so that the filtered taps overlap into an even disc,
// and nothing where the rings are less than a half-res texel (2 px) apart anyway.
float prefilter_px(float coc) {
    float spacing = ring_spacing(abs(coc));
    return spacing > 2.0 ? spacing : 0.0;
}
