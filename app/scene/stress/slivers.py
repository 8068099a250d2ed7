"""Walls cut by slivers of millions to one, with triangles of no area among them, before a bright sky."""

from __future__ import annotations

import numpy as np

from ..decoded import Decoded
from ..model import Environment
from ..validate import RawMesh
from .parts import camera, joined, matt, mesh, staged

SKY = 50.0  # radiance: what shines through a gap
WIDTH = 4e-7  # m of a sliver's short side, at coordinates below 2, where float32 steps by a quarter of that


def make() -> Decoded:
    """A wall near, one in focus, one far behind it: the hard case is a gap, which the sky fills with light."""
    walls = [_wall(-1.2 + 0.35 * k, -1.6 - 0.9 * k, 0.55 + 0.3 * k, k % 3) for k in range(3)]
    colors = [matt((0.0, 0.0, 0.0), c) for c in ((0.4, 0.1, 0.05), (0.1, 0.3, 0.1), (0.05, 0.15, 0.5))]
    return staged(walls, colors, camera(2.5, 0.1), environment=Environment((SKY,) * 3, (SKY,) * 3))


def _wall(left: float, z: float, size: float, material: int) -> RawMesh:
    """A square in 24 columns; between each two a sliver as high as the wall, and a triangle of no area."""
    pieces, x = [], left
    step = 2 * size / 24
    for _ in range(24):
        low, high = -0.5 * size, 1.5 * size
        a, b = np.array([x, low, z]), np.array([x + step, low, z])
        c, d = np.array([x + step, high, z]), np.array([x, high, z])
        inner = np.array([x + step - WIDTH, high, z])  # beside the corner c, so that (b, c, inner) is a sliver
        flat = np.array([x + step, 0.5 * (low + high), z])  # on the edge from b to c
        points, triangles = [a, b, c, d, inner, flat], [[0, 1, 4], [1, 2, 4], [0, 4, 3], [1, 5, 2]]
        pieces.append(mesh(points, triangles, material, np.tile([0.0, 0.0, 1.0], (6, 1))))
        x += step
    return joined(pieces)
