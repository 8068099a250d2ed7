"""glsl/lib/lens.glsl against app.optics in float64, over the aperture's edges and corners."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app import optics

from .harness import call_glsl

EPS = 2.0**-23
# Angles reach 2 pi, where a float32 is 5e-7 coarse; drivers' sin, cos and atan add as much again.
ANGULAR = 4e-6
FILE = "lib/lens.glsl"
APERTURES = [(0, 0.0, 1.0), (3, 0.0, 1.0), (5, -2.0, 1.6), (6, 3.0, 0.5), (9, 0.3, 1.0), (16, 3.14, 2.0)]
EACH_APERTURE = pytest.mark.parametrize(("blades", "rotation", "anamorphic"), APERTURES)
rng = np.random.default_rng(12)


def squares() -> np.ndarray:
    """Points of the unit square as the sampler makes them (multiples of 2^-24), its corners, edges and centre."""
    edge = np.array([0.0, 2.0**-24, 0.25, 0.5, 0.75, 1.0 - 2.0**-24])
    corners = np.stack(np.meshgrid(edge, edge), -1).reshape(-1, 2)
    inner = rng.integers(0, 1 << 24, (4096, 2)) * 2.0**-24
    return np.concatenate([corners, inner]).astype(np.float32)


SQUARES = squares()


@EACH_APERTURE
@pytest.mark.parametrize("aberration", [0.0, 0.7])
def test_lens_point(ctx: moderngl.Context, blades: int, rotation: float, anamorphic: float, aberration: float) -> None:
    call = "vec2 lens_point(vec2 s, int b, float r, float a, float w)"
    found = call_glsl(ctx, FILE, call, SQUARES, blades, rotation, anamorphic, aberration)
    expected = optics.lens_point(
        SQUARES.astype(float),
        blades,
        float(np.float32(rotation)),
        float(np.float32(anamorphic)),
        float(np.float32(aberration)),
    )
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found, expected, atol=ANGULAR * max(1.0, 1.0 / anamorphic))


@EACH_APERTURE
def test_lens_point_stays_inside(ctx: moderngl.Context, blades: int, rotation: float, anamorphic: float) -> None:
    for aberration in (-1.0, 0.0, 1.0):
        call = "vec2 lens_point(vec2 s, int b, float r, float a, float w)"
        points = call_glsl(ctx, FILE, call, SQUARES, blades, rotation, anamorphic, aberration)
        assert optics.lens_gauge(points, blades, rotation, anamorphic).max() <= 1.0 + 2.0 * ANGULAR


def test_aberrated_area_solves_its_equation(ctx: moderngl.Context) -> None:
    """By the residual: near t = 1 with s = -1 the inverse itself is ill-conditioned, its equation is not."""
    u, s = SQUARES[:, 0], (2.0 * SQUARES[:, 1] - 1.0).astype(np.float32)
    s[:4] = -1.0, 0.0, 1.0, 1.0
    t = call_glsl(ctx, FILE, "float aberrated_area(float u, float s)", u, s).astype(float)
    assert np.isfinite(t).all()
    assert t.min() >= 0.0
    assert t.max() <= 1.0 + 4.0 * EPS
    s64 = s.astype(float)
    residual = (1.0 - s64) * t + s64 * t * t - u
    assert (np.abs(residual) <= 8.0 * EPS * (np.abs(1.0 - s64) * t + np.abs(s64) * t * t)).all()


def test_the_barrel(ctx: moderngl.Context) -> None:
    size, cat_eye = (640.0, 360.0), float(np.float32(0.8))
    image_px = (rng.random((2000, 2)) * size).astype(np.float32)
    shift = call_glsl(ctx, FILE, "vec2 barrel_shift(vec2 p, vec2 s, float c)", image_px, size, cat_eye).astype(float)
    np.testing.assert_allclose(shift, optics.barrel_shift(image_px, size, cat_eye), atol=8 * EPS)
    point = (2.0 * rng.random((2000, 2)) - 1.0).astype(np.float32)
    apart = np.linalg.norm(point.astype(float) - shift, axis=-1)
    passes = call_glsl(ctx, FILE, "bool passes_barrel(vec2 p, vec2 s)", point, shift).astype(bool)
    clear = np.abs(apart - 1.0) > 8 * EPS
    assert clear.sum() > 1900
    assert (passes == optics.passes_barrel(point.astype(float), shift))[clear].all()


def test_the_barrel_s_reach(ctx: moderngl.Context) -> None:
    """By where it leads: f itself is ill-conditioned for points close to the centre, the rim's distance is not."""
    point = (2.0 * rng.random((2000, 2)) - 1.0).astype(np.float32)
    angle, length = 7.0 * rng.random(2000), rng.random(2000)
    shift = (0.99 * length[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)).astype(np.float32)
    reach = call_glsl(ctx, FILE, "float barrel_reach(vec2 p, vec2 s)", point, shift).astype(float)
    led = np.linalg.norm(reach[:, None] * point - shift, axis=-1)
    # Both terms of the sum are at most 1 / |p|, so a few roundings of the longer one are what the rim may be off by;
    # where they cancel, the root's argument has lost as much again over 1 - |shift|^2 >= 0.02.
    assert np.abs(led - 1.0).max() < 64 * EPS
    np.testing.assert_allclose(reach, optics.barrel_reach(point.astype(float), shift.astype(float)), rtol=1e-4)


@EACH_APERTURE
def test_lens_spread(ctx: moderngl.Context, blades: int, rotation: float, anamorphic: float) -> None:
    found = call_glsl(ctx, FILE, "float lens_spread(int b, float a, float s)", blades, anamorphic, 0.7)
    assert found[0] == pytest.approx(optics.lens_spread(blades, anamorphic, 0.7), rel=16 * EPS)
