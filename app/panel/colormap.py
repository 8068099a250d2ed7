"""The target viewer's colour maps on the CPU, for the legend and the tests: the twin of glsl/lib/colormap.glsl."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Ends and middles of the diverging map, display values: dark blue, light blue, near white, orange, dark red. Lightness
# falls to both sides, and blue against orange survives the common colour-vision deficiencies.
DIVERGING = np.array(
    [(0.03, 0.16, 0.45), (0.36, 0.63, 0.88), (0.96, 0.96, 0.94), (0.95, 0.56, 0.30), (0.52, 0.05, 0.05)]
)


def sequential(t: ArrayLike) -> Array:
    """[0, 1] (...) to display RGB (..., 3), ever lighter: cubehelix (Green 2011), start 0.5, -1 rotation, hue 1.1."""
    t = np.clip(np.asarray(t, np.float64), 0.0, 1.0)[..., None]
    angle = 2.0 * math.pi * (0.5 / 3.0 + 1.0 - 1.0 * t)
    amplitude = 1.1 * t * (1.0 - t) / 2.0
    c, s = np.cos(angle), np.sin(angle)
    offset = np.concatenate([-0.14861 * c + 1.78277 * s, -0.29227 * c - 0.90649 * s, 1.97294 * c], -1)
    return np.clip(t + amplitude * offset, 0.0, 1.0)


def diverging(s: ArrayLike) -> Array:
    """[-1, 1] (...) to display RGB (..., 3): near white at 0, blue below, orange to red above."""
    x = (np.clip(np.asarray(s, np.float64), -1.0, 1.0) + 1.0) * 2.0
    left = np.minimum(x.astype(int), 3)
    part = (x - left)[..., None]
    return DIVERGING[left] * (1.0 - part) + DIVERGING[left + 1] * part


def signed_unit(value: ArrayLike, low: float, high: float) -> Array:
    """A signed value in units of its side's end: -1 at `low` < 0, 1 at `high` > 0; 0 stays 0, so white means zero."""
    value = np.asarray(value, np.float64)
    return np.where(value < 0.0, -value / min(low, -1e-30), value / max(high, 1e-30))


def wheel(x: ArrayLike, y: ArrayLike) -> Array:
    """A vector of length <= 1 to display RGB (..., 3): hue is its direction (red: right), brightness its length."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    hue = np.arctan2(y, x)[..., None] / (2.0 * math.pi)
    spread = np.abs(np.mod(hue + np.array([0.0, 2.0 / 3.0, 1.0 / 3.0]), 1.0) * 6.0 - 3.0) - 1.0
    return np.clip(spread, 0.0, 1.0) * np.minimum(np.hypot(x, y), 1.0)[..., None]
