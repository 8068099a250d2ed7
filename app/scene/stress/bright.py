"""Lights of a million beside black: what half floats cannot hold, and what a single ray must not smear."""

from __future__ import annotations

from ..decoded import Decoded
from .parts import BLACK, at, ball, camera, card, matt, staged

LIGHT = 1e6  # radiance; half floats end at 65504


def make() -> Decoded:
    """Lamps of 2 mm in front of focus, in it and far behind, before a black wall and behind black bars."""
    black, grey = matt((0.0, 0.0, 0.0)), matt((0.18, 0.18, 0.18), (0.02, 0.02, 0.02))
    lamps = [matt((0.0, 0.0, 0.0), c) for c in ((LIGHT, LIGHT, LIGHT), (LIGHT, 0.0, 0.0), (0.0, 0.02 * LIGHT, LIGHT))]
    meshes = [
        card((-6, -4, -9), (12, 0, 0), (0, 8, 0), 0),
        *(card((0.3 * k - 0.65, -0.8, -2.0), (0.06, 0, 0), (0, 1.6, 0), 1) for k in range(5)),
        *(card((0.11 * k - 0.3, -0.4, -0.7), (0.02, 0, 0), (0, 0.8, 0), 0) for k in range(6)),
        *(ball(0.002, 8, 6, 2 + k) for k in range(3)),
    ]
    bulbs = [
        (len(meshes) - 3 + (i + j) % 3, at(x * z, y * z, -z))
        for z in (0.6, 2.0, 6.0)
        for i, x in enumerate((-0.5, -0.2, 0.1, 0.4))
        for j, y in enumerate((-0.3, 0.0, 0.25))
    ]
    places = [*((i, at(0, 0, 0)) for i in range(len(meshes) - 3)), *bulbs]
    return staged(meshes, [black, grey, *lamps], camera(2.0, 0.05), places=places, environment=BLACK)
