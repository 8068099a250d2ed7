"""FLIP between linear pictures as a viewer sees them (Andersson et al. 2020, LDR): clipped, sRGB-encoded."""

from __future__ import annotations

import flip_evaluator
import numpy as np

from app.tone import srgb_encode


def shown(linear: np.ndarray) -> np.ndarray:
    """Display values 0 to 1 (h, w, 3) float32 of linear light."""
    return np.ascontiguousarray(srgb_encode(np.clip(linear, 0.0, 1.0)), np.float32)


def displayed(linear: np.ndarray) -> np.ndarray:
    """The picture (h, w, 3) uint8 that the default settings display of linear light."""
    return np.rint(255.0 * shown(linear)).astype(np.uint8)


def flip_map(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """FLIP, 0 to 1, at each pixel (h, w) of two linear pictures (h, w, 3), at the metric's default of 67 pixels per
    degree.
    """
    return flip_evaluator.evaluate(shown(a), shown(b), "LDR", applyMagma=False)[0][..., 0]


def mean_flip(a: np.ndarray, b: np.ndarray) -> float:
    """Its mean over the picture."""
    return float(flip_map(a, b).mean(dtype=np.float64))


def flip_of_noise(first_half: np.ndarray, second_half: np.ndarray) -> float:
    """What two independent pictures with the samples of both halves together would differ by.

    The halves differ by this times a factor between sqrt(2), the noise's own, and 1, where FLIP saturates: dividing by
    sqrt(2) never overstates it.
    """
    return mean_flip(first_half, second_half) / np.sqrt(2.0)
