"""glsl/lib/{mask,hit_layers,reconstruct,gradient,catmull_rom}.glsl against their float64 twins."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.optics import IN_FOCUS_COC_PX

from . import hybrid_twin as twin
from .harness import call_glsl

RNG = np.random.default_rng(5)
N = 2000
UNIT = RNG.random(N)
COC = RNG.uniform(-60.0, 20.0, N)
# Near and far part of a light, and of its square with some spread: enough for the root to keep its digits.
MOMENTS = np.stack([0.3 * UNIT, 0.3 * UNIT + 0.1, 0.3 * (1.0 - UNIT), 0.3 * (1.0 - UNIT) + 0.1], -1)
ROUNDING = 2e-6  # a few float32 operations on values near 1

OF_MASK = (
    "mask_response",
    "edge_reach_half",
    "planned_rays",
    "mask_level",
    "coarse_margin_half",
    "light_deviation",
    "scouted_share",
    "ray_weight",
)
OF_RECONSTRUCT = ("gather_radius_half", "reach_weight", "ray_variance", "signal_variance", "neighbour_share")
OF_GRADIENT = ("light_change", "stale_weight")
FILES = {
    "lib/mask.glsl": OF_MASK,
    "lib/reconstruct.glsl": OF_RECONSTRUCT,
    "lib/gradient.glsl": OF_GRADIENT,
    "lib/catmull_rom.glsl": ("catmull_rom",),
}  # the rest: lib/hit_layers.glsl

CASES = {
    "float mask_response(float a, float b)": (
        twin.mask_response,
        10.0 ** RNG.uniform(-4, 3, N),
        10.0 ** RNG.uniform(-2, 2, N),
    ),
    "float edge_reach_half(float a)": (twin.edge_reach_half, COC),
    "float planned_rays(float a, float b, float c, float d)": (
        twin.planned_rays,
        RNG.integers(1, 256, N),
        UNIT,
        1.0,
        16.0,
    ),
    "int mask_level(float a)": (twin.mask_level, RNG.uniform(0.0, 600.0, N)),
    "float coarse_margin_half(int a)": (twin.coarse_margin_half, RNG.integers(1, 64, N)),
    "float scouted_share(float a)": (twin.scouted_share, 0.1 * UNIT),
    "float light_deviation(vec4 a)": (twin.light_deviation, MOMENTS),
    "float ray_weight(float a, float b, float c)": (
        twin.ray_weight,
        UNIT,
        np.where(RNG.random(N) < 0.1, -1.0, 0.5 * RNG.random(N)),
        np.where(RNG.random(N) < 0.1, 0.0, 10.0 * RNG.random(N)),
    ),
    "float catmull_rom(float a)": (twin.catmull_rom, RNG.uniform(-3.0, 3.0, N)),
    "float near_share(float a, float b, float c)": (twin.near_share, COC, IN_FOCUS_COC_PX, RNG.uniform(0.05, 8.0, N)),
    "float raster_share(float a, float b, float c)": (twin.raster_share, 0.1 * COC, IN_FOCUS_COC_PX, 1.0),
    "float post_far_share(float a, float b)": (twin.post_far_share, UNIT, 0.9),
    "float post_near_share(float a, float b)": (twin.post_near_share, 20.0 * UNIT, 4.0),
    "bool same_depth(float a, vec2 b)": (
        lambda coc, circle: twin.same_depth(coc, circle[:, 0], circle[:, 1]),
        COC,
        COC[::-1, None] + RNG.uniform(-4.0, 12.0, (N, 2)),
    ),
    "float light_change(float a, float b)": (twin.light_change, 10.0 ** RNG.uniform(-5, 0, N), UNIT),
    "float stale_weight(float a, float b, float c, float d)": (
        twin.stale_weight,
        0.05,
        RNG.uniform(-0.5, 1.5, N),
        RNG.uniform(0.0, 20.0, N),
        COC,
    ),
    "float newest_weight(float a, float b, float c)": (
        twin.newest_weight,
        RNG.integers(0, 16, N),
        RNG.integers(0, 500, N),
        0.05,
    ),
    "float trusted_ratio(float a, float b, float c)": (twin.trusted_ratio, UNIT, RNG.random(N), RNG.integers(0, 64, N)),
    "float gather_radius_half(float a, float b)": (twin.gather_radius_half, COC, UNIT),
    "float reach_weight(float a, float b)": (twin.reach_weight, 0.1 * COC, RNG.uniform(0.0, 12.0, N)),
    "float ray_variance(float a, float b, float c)": (twin.ray_variance, UNIT, RNG.integers(1, 500, N), RNG.random(N)),
    "float signal_variance(float a, float b)": (twin.signal_variance, UNIT, RNG.random(N)),
    "float neighbour_share(float a, float b)": (
        twin.neighbour_share,
        np.where(UNIT < 0.1, 0.0, UNIT),
        np.where(RNG.random(N) < 0.1, 0.0, RNG.random(N)),
    ),
}


@pytest.mark.parametrize("signature", CASES)
def test_shader_functions_agree_with_their_twins(ctx: moderngl.Context, signature: str) -> None:
    function, *arguments = CASES[signature]
    include = next((file for file, names in FILES.items() if any(n in signature for n in names)), "lib/hit_layers.glsl")
    got = call_glsl(ctx, include, signature, *arguments)
    exact = function(*[np.asarray(a, np.float32).astype(np.float64) if np.ndim(a) else a for a in arguments])
    np.testing.assert_allclose(got, exact, rtol=ROUNDING, atol=ROUNDING)


def test_feather_agrees_with_its_twin(ctx: moderngl.Context) -> None:
    reach = RNG.uniform(2.1, 40.0, N).astype(np.float32)
    power = (reach**2 * UNIT).astype(np.float32)
    got = call_glsl(ctx, "lib/mask.glsl", "float rays_feather(float a, float b)", power, reach)
    # 1 - sqrt(1 - x) loses digits near x = 1: sqrt(2^-24) at worst, times the smoothstep's slope 1.5 / RIM.
    np.testing.assert_allclose(got, twin.rays_feather(power, reach), atol=1.5 / twin.RIM * 2.0**-12)


def test_a_plane_is_no_slope_beside_its_own(ctx: moderngl.Context) -> None:
    differences = RNG.normal(size=(N, 3)).astype(np.float32)
    got = call_glsl(ctx, "lib/mask.glsl", "float own_slope(vec3 a)", differences)
    np.testing.assert_array_equal(got, twin.own_slope(differences))
    assert twin.own_slope([[2.0, 2.0, 2.0], [0.1, 9.0, 0.1], [1.0, -1.0, 1.0]]).tolist() == [2.0, 0.1, 0.0]


def test_the_upsampling_keeps_values_means_and_slopes() -> None:
    taps, at = np.arange(-3, 4), np.linspace(0.0, 1.0, 101)[:, None]
    weights = twin.catmull_rom(at - taps)
    assert (twin.catmull_rom(taps) == (taps == 0)).all()
    np.testing.assert_allclose(weights.sum(1), 1.0, atol=1e-15)
    np.testing.assert_allclose(weights @ taps, at[:, 0], atol=1e-15)


def test_in_focus_surfaces_never_enter_the_near_layer() -> None:
    coc = np.linspace(-IN_FOCUS_COC_PX, 50.0, 100)
    assert not twin.near_share(coc, IN_FOCUS_COC_PX, 8.0).any()
    assert (twin.raster_share(np.linspace(-IN_FOCUS_COC_PX, IN_FOCUS_COC_PX, 9), IN_FOCUS_COC_PX, 1.0) == 1.0).all()


def test_a_contradicted_ratio_is_pulled_to_the_rays_that_contradict_it() -> None:
    assert twin.trusted_ratio(1.0, 0.0, 1e6) == pytest.approx(0.0, abs=1e-5)
    assert twin.trusted_ratio(0.4, 0.5, 4.0) == 0.4
