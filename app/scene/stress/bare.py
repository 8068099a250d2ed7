"""As little as a scene can hold: nothing but sky, and a single triangle."""

from __future__ import annotations

from ..decoded import Decoded
from .parts import camera, matt, mesh, staged, sun


def empty() -> Decoded:
    """No triangle at all."""
    return staged([], [matt((0.5, 0.5, 0.5))], camera(2.0, 0.05), lights=[sun()])


def one_triangle() -> Decoded:
    """One, in front of focus."""
    points = [[-0.2, -0.2, -1.0], [0.25, -0.15, -1.1], [0.0, 0.25, -0.9]]
    return staged([mesh(points, [0, 1, 2], 0)], [matt((0.8, 0.3, 0.1))], camera(2.0, 0.05), lights=[sun()])
