// Spatial reconstruction of the traced layers: how far to gather, from whom, and how much to believe it.
// Float64 twins: tests/gpu/hybrid_twin.py.

const float MOST_GATHER_HALF = 6.0;  // half-res px: RINGS rings then still lie no more than two texels apart
const float PRIOR_RAYS = 8.0;        // two frames of the default budget

// Radius [half-res px] over which a layer of CoC radius `coc` [full-res px] is gathered.
float gather_radius_half(float coc, float share) {
    return min(0.5 * share * abs(coc), MOST_GATHER_HALF);
}

// Weight of a sample of CoC radius `coc` at `distance` [full-res px]: none where its blur ends before it gets here
// (poster, 2.2), fading over a half-res texel.
float reach_weight(float coc, float distance) {
    return clamp(0.5 * (abs(coc) - distance) + 0.5, 0.0, 1.0);
}

// Variance per ray where the pixel's own `rays` rays say `own` (about their mean) and the neighbourhood's say `pooled`,
// which counts as PRIOR_RAYS rays: few rays know little of their variance, and many know it best.
float ray_variance(float own, float rays, float pooled) {
    return (PRIOR_RAYS * pooled + rays * own) / (PRIOR_RAYS + rays - 1.0);
}

// Variance of the true means, from the spread of the estimated ones less what their own noise explains.
float signal_variance(float spread, float noise) {
    return max(spread - noise, 0.0);
}

// Part of a pixel's value that is taken from its neighbours: all where they differ by noise alone, none where the pixel
// is converged (local Wiener filter: Lee 1980).
float neighbour_share(float noise, float signal) {
    return noise > 0.0 ? noise / (noise + signal) : 0.0;
}
