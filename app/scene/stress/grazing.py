"""A floor to the horizon from just above it, and planes that are seen exactly edge on."""

from __future__ import annotations

from ..decoded import Decoded
from .parts import box, camera, card, checker, matt, staged, sun, textured

HORIZON = 20_000.0  # m
EYE = 0.03  # m above the floor


def make() -> Decoded:
    """Depth runs over six decades in a few rows of pixels, and CoC, slope and texture footprint with it."""
    h = HORIZON
    meshes = [
        card((-h, -EYE, 10.0), (2 * h, 0, 0), (0, 0, -h), 0, repeat=2 * h / 4.0),
        card((-0.5, 0.0, -0.5), (1.0, 0, 0), (0, 0, -4.0), 1),  # through the eye: covers nothing
        card((0.0, 0.05, -0.8), (0, 0.3, 0), (0, 0, -3.0), 2),  # upright, likewise
        *(box((0.5 * k - 1.2, -EYE, -1.0 - k), (0.5 * k - 1.1, 0.25, -0.95 - k), 1 + k % 2) for k in range(5)),
    ]
    materials = [textured(0), matt((0.8, 0.3, 0.1)), matt((0.1, 0.3, 0.7))]
    view = camera(2.0, 0.02, target=(0, 0.0, -1))
    return staged(meshes, materials, view, images=[checker()], lights=[sun()])
