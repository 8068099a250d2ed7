"""Polished metal under a sun of 100 000 lux: highlights of a pixel's part, and reflections at grazing angles."""

from __future__ import annotations

from ..decoded import Decoded
from ..model import Material
from .parts import at, ball, camera, card, matt, staged, sun


def make() -> Decoded:
    """Balls of roughness 0 and little more, in front of focus, in it and behind, on a polished floor."""
    metals = [Material((0.9, 0.8, 0.6, 1.0), metallic=1.0, roughness=r) for r in (0.0, 0.02, 0.2)]
    meshes = [*(ball(0.25, 48, 32, k) for k in range(3)), card((-4, -0.5, 1), (8, 0, 0), (0, 0, -12), 0),
              card((-6, -0.5, -9), (12, 0, 0), (0, 6, 0), 3)]  # fmt: skip
    places = [
        *((k, at(0.45 * (k - 1) * z, -0.1, -z)) for z in (1.0, 2.2, 5.0) for k in range(3)),
        (3, at(0, 0, 0)),
        (4, at(0, 0, 0)),
    ]
    return staged(meshes, [*metals, matt((0.05, 0.05, 0.06))], camera(2.2, 0.06), places=places, lights=[sun(1e5)])
