"""Tone curves and the sRGB transfer function in float64: twins of glsl/lib/tone.glsl."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def srgb_encode(linear: ArrayLike) -> Array:
    """sRGB display values of linear 0..1 (IEC 61966-2-1)."""
    x = np.asarray(linear, np.float64)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-8) ** (1 / 2.4) - 0.055)


def srgb_decode(encoded: ArrayLike) -> Array:
    """Linear values of sRGB 0..1: the inverse of `srgb_encode`."""
    x = np.asarray(encoded, np.float64)
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.0) + 0.055) / 1.055) ** 2.4)


def tone_aces(light: ArrayLike) -> Array:
    """Filmic curve (Narkowicz 2015), per channel."""
    x = 0.6 * np.asarray(light, np.float64)
    return np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0)


def tone_neutral(light: ArrayLike) -> Array:
    """Khronos PBR Neutral (2024) for colours (n, 3)."""
    start, desaturation = 0.8 - 0.04, 0.15
    color = np.array(light, np.float64)
    low = color.min(-1, keepdims=True)
    color = color - np.where(low < 0.08, low - 6.25 * low * low, 0.04)
    peak = color.max(-1, keepdims=True)
    span = 1.0 - start
    compressed = 1.0 - span * span / np.maximum(peak + span - start, span)
    bright = color * compressed / np.maximum(peak, 1e-30)
    white = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0)
    return np.where(peak < start, color, bright * (1 - white) + compressed * white)
