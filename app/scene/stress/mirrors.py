"""Polished metal in the sun: highlights beyond half floats on part of a pixel, reflections at grazing angles."""

from __future__ import annotations

from ..decoded import Decoded
from ..model import Material
from .parts import at, ball, camera, card, matt, staged, sun


def make() -> Decoded:
    """Balls of roughness 0 and little more, in front of focus, in it and behind, on a polished floor."""
    metals = [Material((0.9, 0.8, 0.6, 1.0), metallic=1.0, roughness=r) for r in (0.0, 0.02, 0.2)]
    meshes = [*(ball(0.25, 48, 32, k) for k in range(3)), card((-4, -0.5, 1), (8, 0, 0), (0, 0, -12), 0),
              card((-6, -0.5, -9), (12, 0, 0), (0, 6, 0), 3)]  # fmt: skip
    rows = ((1.0, 0.3, -0.27, 0.4), (2.2, 0.7, -0.15, 1.0), (5.0, 1.5, 0.9, 1.6))  # depth, spacing, height, scale
    places = [
        *((k, at(spacing * (k - 1), y, -z, scale)) for z, spacing, y, scale in rows for k in range(3)),
        (3, at(0, 0, 0)),
        (4, at(0, 0, 0)),
    ]
    return staged(meshes, [*metals, matt((0.05, 0.05, 0.06))], camera(2.2, 0.06), places=places, lights=[sun()])
