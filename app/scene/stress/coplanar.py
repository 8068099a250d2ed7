"""Surfaces in one plane: duplicates, overlaps cut differently, and pairs a rounding error apart."""

from __future__ import annotations

import numpy as np

from ..decoded import Decoded
from .parts import camera, card, grid, matt, mesh, staged, sun

RED, GREEN, BLUE, GREY = range(4)


def make() -> Decoded:
    """Pairs of squares side by side in focus, and again blurred in front and behind."""
    colors = [(0.8, 0.1, 0.1), (0.1, 0.7, 0.1), (0.1, 0.2, 0.9), (0.5, 0.5, 0.5)]
    meshes = [card((-8, -1.5, 1), (16, 0, 0), (0, 0, -16), GREY)]
    for z, half in ((-1.2, 0.12), (-2.5, 0.3), (-6.0, 0.8)):
        side = (2 * half, 0, 0), (0, 2 * half, 0)
        left, middle, right = (np.array([k * 2.6 * half - half, -half, z]) for k in (-1, 0, 1))
        meshes += [card(left, *side, RED), card(left, *side, GREEN)]  # the same triangles twice
        cells = grid(middle, *side, 7)
        meshes += [card(middle, *side, RED), mesh(*cells, BLUE, np.tile([0, 0, 1], (len(cells[0]), 1)))]
        tilted = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) * 2 * half
        nearer = np.nextafter(np.float32(z), np.float32(0.0))  # one float32 step in front
        overlap = mesh(right + tilted, [0, 1, 2], GREEN, np.tile([0, 0, 1], (3, 1)))
        meshes += [card((*right[:2], nearer), *side, BLUE), overlap]
    return staged(meshes, [matt(c) for c in colors], camera(2.5, 0.06), lights=[sun()])
