"""The post-process's pure GLSL functions against their float64 twins, and the identities they are built on."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.optics import aberration_weight, coc_px, lens_gauge

from . import post_twin as twin
from .harness import call_glsl

rng = np.random.default_rng(4)
EPS = float(np.finfo(np.float32).eps)
SPLAT, KERNEL = "lib/splat.glsl", "lib/kernel.glsl"


def f32(x: np.ndarray) -> np.ndarray:
    """What the GPU receives, as float64, so that twin and shader see the same input."""
    return x.astype(np.float32).astype(np.float64)


def test_finite_radiance_lets_nothing_odd_through(ctx: moderngl.Context) -> None:
    odd = np.array([np.nan, np.inf, -np.inf, -1.0, -0.0, 0.0, 1e-6, 1.0, 6e4, 7e4, 3e38])
    c = np.stack([odd, np.roll(odd, 1), np.roll(odd, 2), np.roll(odd, 3)], -1)
    assert (
        call_glsl(ctx, "lib/finite.glsl", "vec4 finite_radiance(vec4 c)", c)
        == twin.finite_radiance(c).astype(np.float32)
    ).all()


def test_gathered_coc(ctx: moderngl.Context) -> None:
    coc = np.array([np.nan, np.inf, -np.inf, -50.0, -40.0, 0.0, 3.5, 40.0, 41.0])
    assert (
        call_glsl(ctx, SPLAT, "float gathered_coc(float c, float l)", coc, 40.0) == twin.gathered_coc(coc, 40.0)
    ).all()


def test_silhouette_has_the_blur_of_the_nearer_surface(ctx: moderngl.Context) -> None:
    own, coc = rng.uniform(-40, 40, (2, 1000)).astype(np.float32)
    radius = call_glsl(ctx, SPLAT, "float silhouette_px(float o, float c)", own, coc)
    assert (radius == twin.silhouette_px(own, coc)).all()
    assert (radius == np.where(own < coc, np.abs(own), np.abs(coc))).all()


def test_ring_light_matches_its_twin(ctx: moderngl.Context) -> None:
    inner, width, radius = (rng.uniform(low, high, 5000) for low, high in ((0, 30), (0.01, 9), (0.1, 40)))
    inner2, outer2, radius2, s = f32(inner**2), f32((inner + width) ** 2), f32(radius**2), f32(rng.uniform(-1, 1, 5000))
    got = call_glsl(ctx, SPLAT, "float ring_light(float a, float b, float r, float s)", inner2, outer2, radius2, s)
    # A difference of two numbers of at most 1, each of a few rounded operations with slope <= 3; the reciprocal is good
    # to 2.5 ulp.
    assert np.abs(got - twin.ring_light(inner2, outer2, radius2, s)).max() < 24 * EPS


def test_splat_radii_match_their_twins(ctx: moderngl.Context) -> None:
    radius, spacing, s = f32(rng.uniform(0.1, 40, 5000)), f32(rng.uniform(0.3, 9, 5000)), f32(rng.uniform(-1, 1, 5000))
    variance, spread = f32(rng.uniform(0, 2, 5000)), f32(rng.uniform(0.1, 0.7, 5000))
    got = call_glsl(ctx, SPLAT, "float shrunk_px2(float r, float v, float s)", radius, variance, spread)
    np.testing.assert_allclose(got, twin.shrunk_px2(radius, variance, spread), atol=8 * EPS * 1600)
    radius2 = f32(radius**2)
    got = call_glsl(ctx, SPLAT, "float fitted_px2(float r, float d, float s)", radius2, spacing, s)
    # Between two rims the fit moves by the ring's width while its argument does: up to 20 ulp of the ring's number
    # squared, and a rim taken for its neighbour's ring fits as well.
    np.testing.assert_allclose(got, twin.fitted_px2(radius2, spacing, s), rtol=1e-3)
    inner2, outer2 = f32(rng.uniform(0, 900, 5000)), f32(rng.uniform(900, 1800, 5000))
    got = call_glsl(ctx, SPLAT, "vec2 ring_area(float a, float b, float r)", inner2, outer2, radius2)
    np.testing.assert_allclose(got, twin.ring_area(inner2, outer2, radius2), atol=8 * EPS)


def test_a_ring_s_light_is_its_two_areas_weighted() -> None:
    inner2, outer2, radius2, s = rng.uniform(0, 9, 99), rng.uniform(9, 30, 99), rng.uniform(1, 40, 99), 0.7
    even, squared = np.moveaxis(twin.ring_area(inner2, outer2, radius2), -1, 0)
    light = twin.ring_light(inner2, outer2, radius2, s)
    np.testing.assert_allclose((1 - s) * even + s * squared, light, atol=1e-12)


@pytest.mark.parametrize("aberration", [-0.7, 0.0, 0.7])
def test_a_fitted_splat_is_drawn_as_wide_as_it_is(aberration: float) -> None:
    """Rings spread their light evenly over their area, whatever part of them the splat covers."""
    rims = np.concatenate([[0.0], twin.ring_rim(np.arange(9), 8)]) ** 2
    middles = np.concatenate([[0.0], (rims[2:] + rims[1:-1]) / 2])  # the centre tap lies in the centre
    for radius2 in np.linspace(0.2, 0.95, 40):
        fitted = float(twin.fitted_px2(radius2, 1 / 8.5, aberration))
        light = twin.ring_light(rims[:-1], rims[1:], fitted, aberration)
        assert light.sum() == pytest.approx(1.0, abs=1e-12)
        # A splat that ends on a rim cannot end beyond it, as a bright rim would ask: gather kernels leave that room.
        on_rim = np.abs(fitted / rims[1:] - 1.0).min() < 1e-9
        room = max(aberration, 0.0) * 2.0 / (3.0 * 8.5**2 * radius2) if on_rim else 0.0
        # Left out of the fit: the light of the centre tap, 1/289 of the area, not quite in the centre.
        assert (light * middles).sum() == pytest.approx(radius2 * (0.5 + aberration / 6.0), rel=1e-3 + room)


@pytest.mark.parametrize("aberration", [-1.0, 0.0, 0.7])
def test_rings_of_a_kernel_share_out_a_splat_exactly(aberration: float) -> None:
    for n in (1, 2, 4, 8):
        for radius in np.linspace(0.01, 1.0, 50):  # of the kernel's
            rims = np.concatenate([[0.0], twin.ring_rim(np.arange(n + 1), n)]) ** 2
            assert twin.ring_light(rims[:-1], rims[1:], radius**2, aberration).sum() == pytest.approx(1.0, abs=1e-12)


def test_ring_light_is_the_integral_of_the_lens_weight() -> None:
    t = (np.arange(20000) + 0.5) / 20000
    weight = aberration_weight(t, 0.6)
    inside = (t >= 0.2) & (t < 0.45)
    assert twin.ring_light(0.2 * 9, 0.45 * 9, 9.0, 0.6) == pytest.approx(weight[inside].mean() * 0.25, abs=1e-4)


def test_layer_shares(ctx: moderngl.Context) -> None:
    coc, nearest = f32(rng.uniform(-40, 40, (2, 3000)))
    near = call_glsl(ctx, SPLAT, "float front_share(float c, float a, float b)", coc, 2.0, 4.0)
    fore = call_glsl(ctx, SPLAT, "float fore_share(float c, float n, float f)", coc, nearest, 2.0)
    assert np.abs(near - twin.front_share(coc, 2.0, 4.0)).max() < 8 * EPS
    # t = (c - n) / fade: the difference is exact to 1/2 ulp, the quotient to 2.5; smoothstep's slope is at most 1.5.
    assert np.abs(fore - twin.fore_share(coc, nearest, 2.0)).max() < 16 * EPS


def test_stacked_layers_never_cover_more_than_the_lens(ctx: moderngl.Context) -> None:
    fore, behind = f32(rng.uniform(0, 1.5, (2, 2000, 4)))
    got = call_glsl(ctx, SPLAT, "vec4 stacked(vec4 f, vec4 b)", fore, behind)
    assert np.abs(got - twin.stacked(fore, behind)).max() < 32 * EPS * 2
    assert got[:, 3].max() <= 1.0 + 4 * EPS
    alone = call_glsl(ctx, SPLAT, "vec4 stacked(vec4 f, vec4 b)", np.zeros(4), np.array([0.1, 0.2, 0.3, 0.5]))
    assert np.abs(alone - [0.1, 0.2, 0.3, 0.5]).max() < EPS


@pytest.mark.parametrize(("blades", "anamorphic"), [(0, 1.0), (0, 2.0), (3, 1.0), (6, 1.5)])
def test_kernel_taps_match_their_twins_and_fill_their_rings(
    ctx: moderngl.Context, blades: int, anamorphic: float
) -> None:
    n, frame, rotation = 4, 13, 0.4
    index = np.arange(twin.kernel_taps(n))
    signature = "vec2 kernel_tap(int i, int n, uint f, int b, float r, float a)"
    got = call_glsl(ctx, KERNEL, signature, index, n, frame, blades, rotation, anamorphic)
    turned = float(np.float32(rotation))
    expected = np.array([twin.kernel_tap(i, n, frame, blades, turned, anamorphic) for i in index])
    # GLSL leaves the error of sin and cos open; 2^-11 is what desktop drivers keep, far below a texel.
    assert np.abs(got - expected).max() < 2.0**-11
    gauge = lens_gauge(got, blades, rotation, anamorphic)
    for k in range(1, n + 1):
        ring = gauge[twin.first_tap(k) : twin.first_tap(k) + twin.ring_taps(k)]
        assert (ring > twin.ring_rim(k - 1, n) - 1e-3).all()
        assert (ring < twin.ring_rim(k, n) + 1e-3).all()


def test_ring_counts(ctx: moderngl.Context) -> None:
    radius = np.array([0.0, 0.3, 1.0, 1.4999, 1.6, 2.6, 3.7, 4.4, 100.0], np.float32)
    assert (call_glsl(ctx, KERNEL, "int ring_count(float r, int m)", radius, 4) == twin.ring_count(radius, 4)).all()


def test_median_is_exact(ctx: moderngl.Context) -> None:
    v = rng.standard_normal((2000, 9)).astype(np.float32)
    v[:500] = rng.integers(0, 3, (500, 9))  # ties
    extra = """vec4 middle(vec4 a, vec4 b, float c) {
    vec4 v[9] = vec4[9](a.xxxx, a.yyyy, a.zzzz, a.wwww, b.xxxx, b.yyyy, b.zzzz, b.wwww, vec4(c));
    return median9(v);
}"""
    got = call_glsl(
        ctx, "lib/median.glsl", "vec4 middle(vec4 a, vec4 b, float c)", v[:, :4], v[:, 4:8], v[:, 8], extra=extra
    )
    assert (got == np.median(v, axis=1)[:, None]).all()


def test_tile_reach(ctx: moderngl.Context) -> None:
    radius = np.array([-5.0, 0.0, 0.7, 0.72, 12.9, 13.0, 13.1, 29.1, 100.0], np.float32)
    assert (call_glsl(ctx, "lib/tile_reach.glsl", "int tile_reach(float r)", radius) == twin.tile_reach(radius)).all()


def test_coc_of_depth(ctx: moderngl.Context) -> None:
    z, k, inverse = f32(rng.uniform(0.1, 50, 2000)), f32(rng.uniform(1, 500, 2000)), f32(rng.uniform(0.02, 5, 2000))
    got = call_glsl(ctx, "lib/coc.glsl", "float coc_px(float z, float k, float i)", z, k, inverse)
    # The difference 1/d - 1/z cancels near focus: the error is a few ulp of its terms, not of the result.
    assert (np.abs(got - coc_px(z, k, inverse)) < 4 * EPS * k * (inverse + 1 / z)).all()
