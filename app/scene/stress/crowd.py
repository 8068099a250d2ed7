"""A hundred thousand small things, each an instance of its own."""

from __future__ import annotations

import numpy as np

from ..decoded import Decoded
from .parts import at, camera, card, matt, mesh, staged, sun

COUNT = 100_000


def make(count: int = COUNT) -> Decoded:
    """Tetrahedra of a few millimetres, strewn from before the lens to far behind focus, denser with depth."""
    points = 0.01 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
    colors = ((0.8, 0.2, 0.1), (0.9, 0.7, 0.2), (0.2, 0.5, 0.8), (0.8, 0.8, 0.8))
    floor = card((-20, -1.6, 2), (40, 0, 0), (0, 0, -40), len(colors))
    meshes = [*(mesh(points, faces, k) for k in range(len(colors))), floor]
    random = np.random.default_rng(3)
    depth = 0.4 + 14.0 * np.sqrt(random.random(count))
    across = random.uniform(-0.8, 0.8, (count, 2)) * depth[:, None]
    place = np.tile(np.eye(4), (count, 1, 1))
    place[:, :3, :3] = np.linalg.qr(random.normal(size=(count, 3, 3)))[0]
    place[:, :3, 3] = np.column_stack([across[:, 0], np.maximum(0.6 * across[:, 1], -1.55), -depth])
    kinds = random.integers(0, len(colors), count)
    places = [(int(kind), matrix) for kind, matrix in zip(kinds, place, strict=True)]
    materials = [*(matt(c) for c in colors), matt((0.3, 0.32, 0.35))]
    return staged(meshes, materials, camera(4.0, 0.06), places=[(len(meshes) - 1, at(0, 0, 0)), *places],
                  lights=[sun()])  # fmt: skip
