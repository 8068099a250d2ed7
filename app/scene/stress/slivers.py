"""Walls cut by slivers of millions to one, with triangles of no area among them, before a bright backdrop."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..decoded import Decoded
from ..validate import RawMesh
from .parts import BLACK, Rgb, Vec3, camera, card, joined, matt, mesh, staged

GLARE = 50.0  # radiance of the backdrop: what shines through a gap
WIDTH = 4e-7  # m of a sliver's short side, at coordinates below 2, where float32 steps by up to a quarter of that
COLUMNS = 24  # of a wall, with a sliver between each two
WALLS: tuple[tuple[Vec3, float, Rgb], ...] = (  # middle, m; side, m; light
    ((-0.65, 0.27, -1.6), 1.1, (0.4, 0.1, 0.05)),
    ((0.0, 0.42, -2.5), 1.7, (0.1, 0.3, 0.1)),
    ((0.65, 0.57, -3.4), 2.3, (0.05, 0.15, 0.5)),
)


def make() -> Decoded:
    """A wall near, one in focus, one far behind it: the hard case is a gap, which the backdrop fills with light."""
    backdrop = card((-60, -40, -30), (120, 0, 0), (0, 80, 0), len(WALLS))
    walls = [_wall(np.array(middle), side, k) for k, (middle, side, _) in enumerate(WALLS)]
    glowing = [matt((0.0, 0.0, 0.0), light) for light in (*(light for *_, light in WALLS), (GLARE,) * 3)]
    return staged([*walls, backdrop], glowing, camera(2.5, 0.1), environment=BLACK)


def _wall(middle: np.ndarray, side: float, material: int) -> RawMesh:
    """A square in columns; between each two a sliver as high as the wall, and a triangle of no area."""
    pieces = []
    edges = np.linspace(-0.5 * side, 0.5 * side, COLUMNS + 1)
    for left, right in pairwise(edges):
        # Counter-clockwise from the lower left; then beside the upper right, for the sliver, and on the right side.
        x, y = np.array([left, right, right, left, right - WIDTH, right]), 0.5 * side * np.array([-1, -1, 1, 1, 1, 0])
        triangles = [[0, 1, 4], [1, 2, 4], [0, 4, 3], [1, 5, 2]]
        points = middle + np.stack([x, y, 0 * x], 1)
        pieces.append(mesh(points, triangles, material, np.tile([0.0, 0.0, 1.0], (6, 1))))
    return joined(pieces)
