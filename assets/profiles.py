"""Outlines of turned objects, (k, 2) radius and height in metres, for `shapes.lathe`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from shapes import spline

F64 = NDArray[np.float64]


def vase_profile() -> F64:
    """Foot, belly, neck and lip, closed by an inner wall."""
    outline = [(0.0, 0.0), (0.044, 0.0), (0.047, 0.006), (0.045, 0.02), (0.072, 0.075), (0.086, 0.13), (0.074, 0.19)]
    neck = [
        (0.042, 0.235),
        (0.034, 0.262),
        (0.040, 0.288),
        (0.056, 0.306),
        (0.053, 0.309),
        (0.034, 0.286),
        (0.028, 0.255),
    ]
    return spline(np.array(outline + neck), 65)


def pawn_profile() -> F64:
    """A turned pawn, 7 cm high."""
    points = [(0, 0), (0.02, 0), (0.021, 0.004), (0.019, 0.009), (0.0145, 0.013), (0.0085, 0.026), (0.0065, 0.04)]
    head = [
        (0.0125, 0.044),
        (0.0125, 0.0465),
        (0.007, 0.0485),
        (0.0108, 0.054),
        (0.0118, 0.0605),
        (0.0075, 0.0685),
        (0, 0.071),
    ]
    return spline(np.array(points + head), 40)


def queen_profile() -> F64:
    """A turned queen, 12 cm high."""
    points = [
        (0, 0),
        (0.025, 0),
        (0.026, 0.006),
        (0.022, 0.013),
        (0.016, 0.02),
        (0.0095, 0.045),
        (0.008, 0.075),
        (0.0165, 0.08),
    ]
    crown = [
        (0.0165, 0.0835),
        (0.009, 0.086),
        (0.0115, 0.095),
        (0.0175, 0.105),
        (0.0135, 0.108),
        (0.006, 0.110),
        (0.006, 0.117),
        (0, 0.12),
    ]
    return spline(np.array(points + crown), 48)
