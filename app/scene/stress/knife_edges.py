"""Thin blades exactly in focus, and a rounding error, a millimetre and a metre before and behind it."""

from __future__ import annotations

import numpy as np

from ..decoded import Decoded
from .parts import camera, card, checker, matt, staged, sun, textured

FOCUS = 2.0  # m: a number that float32 holds exactly


def make() -> Decoded:
    """The sign of the CoC changes within a blade's row; silhouettes of zero blur stand before much of it."""
    exact = np.float32(FOCUS)
    depths = [
        exact,
        np.nextafter(exact, np.float32(0)),
        np.nextafter(exact, np.float32(9)),
        1.999,
        2.001,
        1.0,
        0.6,
        4.0,
    ]
    blades = [
        card((0.14 * z * (k - 3.7), -0.3 * z, -z), (0.004 * z * (1 + k % 3), 0, 0), (0.02 * z, 0.6 * z, 0), k % 4)
        for k, z in enumerate(map(float, depths))
    ]
    tilted = card((-0.9, -0.62, -FOCUS + 0.2), (1.8, 0, 0), (0, 0.1, -0.4), 4)  # crosses the focal plane
    wall = card((-5, -4, -8), (10, 0, 0), (0, 8, 0), 5, repeat=4.0)
    colors = ((0.9, 0.2, 0.1), (0.2, 0.7, 0.2), (0.2, 0.3, 0.9), (0.9, 0.8, 0.2), (0.6, 0.6, 0.6))
    return staged([*blades, tilted, wall], [*(matt(c) for c in colors), textured(0)], camera(FOCUS, 0.15),
                  lights=[sun(3.0, (-0.3, -0.6, -0.8))], images=[checker()])  # fmt: skip
