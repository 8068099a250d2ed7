"""Tone curves and the sRGB transfer function: inverses, limits, order, hue."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.tone import srgb_decode, srgb_encode, tone_aces, tone_neutral

unit = st.floats(0.0, 1.0)
light = st.floats(0.0, 1e6)
colors = st.tuples(light, light, light)
LINEAR_END = 0.0031308  # where the standard's two segments meet (to its own rounding)


@given(x=unit)
def test_decode_inverts_encode(x: float) -> None:
    # the standard rounds its constants, so the segments overlap by 1e-7 at the joint
    assert float(srgb_decode(srgb_encode(x))) == pytest.approx(x, abs=1e-13 if abs(x - LINEAR_END) > 1e-7 else 1e-7)


def test_every_8_bit_code_survives() -> None:
    codes = np.arange(256)
    assert (np.rint(srgb_encode(srgb_decode(codes / 255)) * 255) == codes).all()


def test_known_values_of_the_standard() -> None:
    np.testing.assert_allclose(srgb_encode([0.0, 1.0, 0.0031308]), [0.0, 1.0, 0.04045], atol=1e-6)
    assert float(srgb_encode(0.18)) == pytest.approx(0.46135612950)  # middle grey


@given(x=unit, y=unit)
def test_encoding_keeps_order(x: float, y: float) -> None:
    low, high = sorted((x, y))
    assert float(srgb_encode(low)) <= float(srgb_encode(high)) + 1e-7


@given(x=light, y=light)
def test_aces_is_monotonic_and_bounded(x: float, y: float) -> None:
    low, high = (float(tone_aces(v)) for v in sorted((x, y)))
    assert 0.0 <= low <= high + 1e-15
    assert high <= 1.0
    assert float(tone_aces(0.0)) == 0.0


@given(color=colors)
def test_neutral_is_bounded_and_finite(color: tuple[float, float, float]) -> None:
    out = tone_neutral([color])[0]
    assert np.isfinite(out).all()
    assert out.min() >= -1e-12
    assert out.max() <= 1.0


@given(color=st.tuples(*[st.floats(0.08, 0.76)] * 3))
def test_neutral_only_offsets_what_a_display_can_show(color: tuple[float, float, float]) -> None:
    """Below the shoulder it subtracts the 4 % that Fresnel reflection adds, and nothing else."""
    np.testing.assert_allclose(tone_neutral([color])[0], np.array(color) - 0.04, atol=1e-15)


@given(grey=light)
def test_neutral_keeps_greys_grey_and_in_order(grey: float) -> None:
    out = tone_neutral([[grey] * 3, [grey * 1.01 + 1e-9] * 3])
    assert np.ptp(out, axis=-1).max() <= 1e-12
    assert out[1, 0] >= out[0, 0] - 1e-12


@given(color=colors)
def test_neutral_keeps_the_order_of_channels(color: tuple[float, float, float]) -> None:
    """Hue may lose saturation but never turns: no channel overtakes another."""
    out, order = tone_neutral([color])[0], np.argsort(color)
    assert (np.diff(out[order]) >= -1e-12).all()


def test_neutral_is_continuous_at_its_joints() -> None:
    for joint in (0.08, 0.8):
        around = tone_neutral(np.array([[joint - 1e-9] * 3, [joint + 1e-9] * 3]))
        assert np.abs(np.diff(around, axis=0)).max() < 1e-8
