"""glsl/lib/tone.glsl against app.tone in float64."""

from __future__ import annotations

import moderngl
import numpy as np

from app import tone

from .harness import call_glsl

EPS = 2.0**-23
FILE = "lib/tone.glsl"
rng = np.random.default_rng(13)

LIGHT = np.exp(rng.uniform(np.log(1e-6), np.log(1e5), (4096, 3))).astype(np.float32)
LIGHT[:8] = [
    [0, 0, 0],
    [0.08] * 3,
    [0.8] * 3,
    [1, 0, 0],
    [0.76, 0.76, 0.04],
    [0, 0, 1e5],
    [1e-6, 1, 1e5],
    [0.0031308] * 3,
]
UNIT = rng.random((4096, 3)).astype(np.float32)
UNIT[:4] = [[0, 1, 0.0031308], [1e-8, 1e-30, 0.003], [0.0031309, 0.5, 0.18], [1, 1, 1]]


def test_srgb_encode(ctx: moderngl.Context) -> None:
    found = call_glsl(ctx, FILE, "vec3 srgb_encode(vec3 x)", UNIT)
    # pow is exp2 of a product: its rounding grows with the exponent, at most log2(0.0031308) / 2.4 = 3.5
    np.testing.assert_allclose(found, tone.srgb_encode(UNIT), atol=8.0 * EPS)


def test_tone_aces(ctx: moderngl.Context) -> None:
    found = call_glsl(ctx, FILE, "vec3 tone_aces(vec3 x)", LIGHT)
    np.testing.assert_allclose(found, tone.tone_aces(LIGHT), rtol=12.0 * EPS)  # a ratio of sums of positive terms


def test_tone_neutral(ctx: moderngl.Context) -> None:
    found = call_glsl(ctx, FILE, "vec3 tone_neutral(vec3 x)", LIGHT)
    np.testing.assert_allclose(
        found, tone.tone_neutral(LIGHT), atol=16.0 * EPS
    )  # values up to 1 after an offset of 0.04


def test_display_levels_match_to_the_8_bit_code(ctx: moderngl.Context) -> None:
    """No code moves except where float32 meets a rounding boundary."""
    codes = np.arange(256)
    linear = np.repeat(tone.srgb_decode(codes / 255.0)[:, None], 3, 1).astype(np.float32)
    found = call_glsl(ctx, FILE, "vec3 srgb_encode(vec3 x)", linear)
    assert (np.rint(found * 255.0) == codes[:, None]).all()
