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
