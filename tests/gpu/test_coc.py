"""glsl/lib/coc.glsl against app.optics in float64, within what float32 can hold."""

from __future__ import annotations

import moderngl
import numpy as np

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
