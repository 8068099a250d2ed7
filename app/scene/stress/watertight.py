"""Closed shells, each around a lamp: what is seen is dim unless a ray slips between two triangles.

A hole in a mesh mostly shows the inside of its far wall, which looks like the mesh. The lamps make each one shine.
"""

from __future__ import annotations

import numpy as np

from ..decoded import Decoded
from .parts import BLACK, at, ball, camera, closed_box, matt, staged, turned

SHELL = 0.02  # radiance of the dimmest shell: the brightest pixel of a picture without holes is twice that
LAMP = 1000.0


def make() -> Decoded:
    """Corners, edges and poles where many triangles meet face the camera, on pixel rays along the axes too."""
    shells = [matt((0.0, 0.0, 0.0), (SHELL * k,) * 3) for k in (1.0, 1.5, 2.0)]
    meshes = [
        closed_box(0.5, 32, 0),
        ball(0.5, 64, 48, 1),
        closed_box(0.5, 1, 2),
        ball(0.2, 12, 8, 3),
    ]
    corner = turned(np.degrees(np.arctan(np.sqrt(0.5))), 0) @ turned(45.0)  # the diagonal towards the camera
    bodies = [
        (0, at(-1.3, 0.55, -4.0)),
        (0, at(0.0, 0.55, -3.0) @ turned(45.0)),
        (1, at(1.3, 0.55, -4.0)),
        (2, at(-0.55, -0.55, -2.5) @ corner),
        (2, at(0.0, -0.8, -4.0)),
        (1, at(0.6, -0.5, -2.2, 0.6) @ turned(90.0)),
    ]
    lamps = [(3, place) for _, place in bodies]
    lamp = matt((0.0, 0.0, 0.0), (LAMP,) * 3)
    return staged(meshes, [*shells, lamp], camera(3.0, 0.08), places=[*bodies, *lamps], environment=BLACK)
