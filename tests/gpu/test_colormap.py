"""The target viewer's colour maps: GLSL against the twins that the legend shows, and the order they promise."""

from __future__ import annotations

import numpy as np
import pytest

from app.panel.colormap import diverging, sequential, signed_unit, wheel

from .harness import call_glsl

EPS = 8 * np.finfo(np.float32).eps
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def lightness(display: np.ndarray) -> np.ndarray:
    """CIE L* of display RGB, near enough for order: the cube root of luminance after an exponent of 2.2."""
    return np.cbrt(np.asarray(display) ** 2.2 @ LUMINANCE)


def test_sequential_agrees_with_its_twin(ctx: object) -> None:
    t = np.linspace(-0.5, 1.5, 401)
    # sine and cosine of angles up to 7.3 rad are only promised to about 2^-11 of full scale by GLSL
    np.testing.assert_allclose(
        call_glsl(ctx, "lib/colormap.glsl", "vec3 sequential(float t)", t), sequential(t), atol=2**-11
    )


def test_diverging_agrees_with_its_twin(ctx: object) -> None:
    s = np.linspace(-1.5, 1.5, 401)
    # positions x in 0..4 are rounded once more than the colours, whose slope is below 0.5 a step
    np.testing.assert_allclose(
        call_glsl(ctx, "lib/colormap.glsl", "vec3 diverging(float s)", s), diverging(s), atol=4 * EPS
    )


def test_signed_values_agree_with_their_twin(ctx: object) -> None:
    value = np.linspace(-30.0, 30.0, 241)
    for low, high in ((-20.0, 20.0), (-5.0, 40.0), (0.0, 1.0)):
        found = call_glsl(
            ctx, "lib/colormap.glsl", "float signed_unit(float v, float low, float high)", value, low, high
        )
        np.testing.assert_allclose(found, signed_unit(value, low, high), rtol=EPS)


def test_the_wheel_agrees_with_its_twin(ctx: object) -> None:
    angle, length = np.meshgrid(np.linspace(-np.pi, np.pi, 73), np.linspace(0.0, 1.5, 7))
    x, y = (length * np.cos(angle)).ravel(), (length * np.sin(angle)).ravel()
    found = call_glsl(ctx, "lib/colormap.glsl", "vec3 wheel(float x, float y)", x, y)
    # hue wraps at +-pi without a jump; GLSL's atan is promised to 4096 units in the last place, times 6 for hue's slope
    np.testing.assert_allclose(found, wheel(x, y), atol=6 * 4096 * np.finfo(np.float32).eps)


def test_more_is_lighter_along_the_sequential_map() -> None:
    assert (np.diff(lightness(sequential(np.linspace(0.0, 1.0, 257)))) > 0.0).all()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_farther_from_zero_is_darker_along_the_diverging_map(side: float) -> None:
    assert (np.diff(lightness(diverging(side * np.linspace(0.0, 1.0, 257)))) < 0.0).all()


def test_zero_is_neutral_and_the_ends_are_the_ranges() -> None:
    assert signed_unit(0.0, -3.0, 9.0) == 0.0
    assert signed_unit(-3.0, -3.0, 9.0) == -1.0
    assert signed_unit(9.0, -3.0, 9.0) == 1.0
    assert np.ptp(diverging(0.0)) < 0.03  # near white has no hue
