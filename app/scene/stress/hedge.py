"""A hedge of 72 layers of leaves, which are holes for the most part: rays and raster pass many and end late."""

from __future__ import annotations

import numpy as np

from ..decoded import Decoded
from ..model import Image
from .parts import camera, card, matt, staged, sun, textured

LAYERS = 72
LEAVES = 9  # on a texture; they cover a tenth of it, so that one ray in two thousand passes all layers


def make() -> Decoded:
    """Layers from close to the lens to well behind focus, and a bright wall at the end."""
    depths = np.geomspace(0.5, 6.0, LAYERS)
    greens = [textured(0, (0.25 + 0.1 * k, 0.6, 0.2), cutoff=0.5) for k in range(4)]
    layers = [
        card(
            (-z, -0.7 * z, -z),
            (2 * z, 0, 0),
            (0, 1.4 * z, 0.1 * np.sin(float(k))),
            1 + k % 4,
            repeat=2.0 + 0.25 * z,
            shift=(0.377 * k, 0.618 * k),
        )
        for k, z in enumerate(depths)
    ]
    wall = card((-12, -9, -10), (24, 0, 0), (0, 18, 0), 0)
    return staged(
        [wall, *layers],
        [matt((0.8, 0.75, 0.6), (1.5, 1.4, 1.0)), *greens],
        camera(2.0, 0.05),
        lights=[sun(3.0, (-0.3, -0.6, -0.8))],
        images=[_leaves()],
    )


def _leaves(side: int = 128) -> Image:
    """Ellipses on a clear ground."""
    random = np.random.default_rng(7)
    y, x = (np.indices((side, side)) + 0.5) / side
    opaque = np.zeros((side, side), bool)
    for cx, cy, angle in random.uniform((0, 0, 0), (1, 1, np.pi), (LEAVES, 3)):
        dx, dy = (d - np.round(d) for d in (x - cx, y - cy))  # leaves go on at the other side of the texture
        along, across = dx * np.cos(angle) + dy * np.sin(angle), dy * np.cos(angle) - dx * np.sin(angle)
        opaque |= (along / 0.09) ** 2 + (across / 0.04) ** 2 < 1.0
    shade = (150 + 80 * y).astype(np.uint8)
    return Image(np.dstack([shade, shade, shade, np.where(opaque, 255, 0).astype(np.uint8)]), srgb=True)
