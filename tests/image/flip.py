"""Mean FLIP between linear pictures as a viewer sees them (Andersson et al. 2020, LDR): clipped, sRGB-encoded."""

from __future__ import annotations

import flip_evaluator
import numpy as np

from app.tone import srgb_encode


def mean_flip(a: np.ndarray, b: np.ndarray) -> float:
    """Mean FLIP, 0 to 1, of two linear pictures (h, w, 3), at the metric's default of 67 pixels per degree."""
    shown = [np.ascontiguousarray(srgb_encode(np.clip(p, 0.0, 1.0)), np.float32) for p in (a, b)]
    return float(flip_evaluator.evaluate(shown[0], shown[1], "LDR", applyMagma=False)[1])


def flip_of_noise(first_half: np.ndarray, second_half: np.ndarray) -> float:
    """What two independent pictures with the samples of both halves together would differ by.

    The halves differ by this times a factor between sqrt(2), the noise's own, and 1, where FLIP saturates: dividing by
    sqrt(2) never overstates it.
    """
    return mean_flip(first_half, second_half) / np.sqrt(2.0)
