"""glsl/lib/coc.glsl against app.optics in float64, within what float32 can hold."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app import optics

from .harness import call_glsl

EPS = 2.0**-23
rng = np.random.default_rng(11)
COUNT = 4096

# What a setting may be, and the edges: the near plane, the focal plane itself, its float neighbours, the sky.
DEPTH = np.exp(rng.uniform(np.log(1e-2), np.log(1e6), COUNT)).astype(np.float32)
FOCUS = np.exp(rng.uniform(np.log(1e-3), np.log(1e6), COUNT)).astype(np.float32)
DEPTH[:4] = 1e-2, 1e9, FOCUS[2], np.nextafter(FOCUS[3], np.float32(np.inf))
SCALE = np.exp(rng.uniform(np.log(1e-3), np.log(1e5), COUNT)).astype(np.float32)
SCALE[4] = 0.0
INVERSE = (np.float32(1.0) / FOCUS).astype(np.float32)
INVERSE[5] = 0.0  # focused at infinity


def gpu_coc(ctx: moderngl.Context, z: np.ndarray) -> np.ndarray:
    return call_glsl(ctx, "lib/coc.glsl", "float coc_px(float z, float k, float i)", z, SCALE, INVERSE)


def test_coc_is_as_exact_as_its_subtraction_allows(ctx: moderngl.Context) -> None:
    expected = optics.coc_px(DEPTH.astype(float), SCALE.astype(float), INVERSE.astype(float))
    # 1/z is rounded (2.5 ulp are allowed), then the difference and the product
    tolerance = 4.0 * EPS * SCALE.astype(float) * (INVERSE.astype(float) + 1.0 / DEPTH)
    assert (np.abs(gpu_coc(ctx, DEPTH) - expected) <= tolerance).all()


def test_sign_and_order_survive_float32(ctx: moderngl.Context) -> None:
    coc = gpu_coc(ctx, DEPTH)
    clear = np.abs(INVERSE.astype(float) * DEPTH - 1.0) > 1e-5
    assert (np.sign(coc) == np.sign(DEPTH.astype(float) - 1.0 / np.maximum(INVERSE, 1e-30)))[clear & (SCALE > 0)].all()
    ordered = np.sort(DEPTH)
    values = call_glsl(ctx, "lib/coc.glsl", "float coc_px(float z, float k, float i)", ordered, 100.0, 0.5)
    assert (np.diff(values) >= 0.0).all()


COC = "float coc_px(float z, float k, float i)"


def stepped(values: np.ndarray, ulps: int) -> np.ndarray:
    """Positive float32 moved by a number of representable values."""
    return (values.view(np.int32) + ulps).view(np.float32)


@pytest.mark.parametrize("ulps", [-1000, -16, -4, 4, 16, 1000])
def test_the_sign_is_right_from_four_float32_depths_beside_focus(ctx: moderngl.Context, ulps: int) -> None:
    """The reciprocal errs by 2.5 ulps on any GPU and by half of one here, where the sign is never wrong at all."""
    coc = call_glsl(ctx, "lib/coc.glsl", COC, stepped(FOCUS, ulps), 1.0, 1.0 / FOCUS.astype(float))
    assert (np.sign(coc) == np.sign(ulps)).all()


def test_at_focus_the_blur_is_the_rounding_of_a_reciprocal(ctx: moderngl.Context) -> None:
    """Focused at d in float64, of which depth holds the nearest float32: at most four ulps of K / d, and mostly 0.

    K (z - d) / (z d) would be exactly 0 (Sterbenz 1974), but its error far from focus is half as large again, and it
    has no value at infinity. Half an ulp is far below the half pixel that counts as in focus.
    """
    coc = call_glsl(ctx, "lib/coc.glsl", COC, FOCUS, 1.0, 1.0 / FOCUS.astype(float)).astype(float)
    assert (np.abs(coc) <= 4.0 * EPS / FOCUS).all()
    assert (coc == 0.0).mean() > 0.5


def test_infinite_and_vanishing_depths_have_their_limits(ctx: moderngl.Context) -> None:
    """Nothing is blurred more than what is at infinity, and a depth whose reciprocal overflows blurs to the limit."""
    inverse = INVERSE.astype(float)
    for far in (np.inf, optics.SKY_DEPTH):
        coc = call_glsl(ctx, "lib/coc.glsl", COC, far, SCALE, INVERSE).astype(float)
        np.testing.assert_allclose(
            coc, SCALE.astype(float) * inverse, rtol=EPS, atol=2 / optics.SKY_DEPTH * SCALE.max()
        )
        assert (gpu_coc(ctx, DEPTH) <= coc * (1.0 + 4.0 * EPS)).all()
    tiny = np.array([2.0**-149, 1e-40, 2.0**-127], np.float32)
    call = "float limited(float z, float k, float i)"
    extra = '#include "lib/splat.glsl"\n' + call + " { return gathered_coc(coc_px(z, k, i), 100.0); }"
    assert (call_glsl(ctx, "lib/coc.glsl", call, tiny, 1.0, 0.5, extra=extra) == -100.0).all()
