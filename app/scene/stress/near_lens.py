"""Things at the lens: blades through it, across the near plane, and blur that is larger than the picture."""

from __future__ import annotations

from ..decoded import Decoded
from .parts import at, ball, box, camera, card, checker, matt, staged, sun, textured


def make() -> Decoded:
    """A slab from behind the lens to the focal plane, a wire just before the lens, and a wall in focus."""
    meshes = [
        card((-4, -2, -3), (8, 0, 0), (0, 4, 0), 0, repeat=4.0),
        card((-0.02, -1, 0.5), (0, 0, -3.2), (0, 0.99, 0), 1),  # its upper edge passes 1 cm below the lens' centre
        card((0.004, 0.02, -0.05), (0.003, 0, 0), (0, 0.5, -0.02), 2),  # a wire whose CoC is larger than the picture
        card((-0.4, 0.03, 0.3), (0.3, 0.1, -0.8), (0.02, 0.2, 0), 3),  # cuts through the lens and the near plane
        box((0.3, -0.3, -0.42), (0.36, 0.3, -0.36), 2),
        ball(0.25, 24, 16, 3),
    ]
    places = [*((i, at(0, 0, 0)) for i in range(len(meshes) - 1)), (len(meshes) - 1, at(0.7, 0.35, -2.6))]
    colors = [textured(0), *(matt(c) for c in ((0.7, 0.2, 0.1), (0.1, 0.1, 0.1), (0.2, 0.5, 0.7)))]
    return staged(
        meshes,
        colors,
        camera(3.0, 0.12),
        places=places,
        lights=[sun(3.0, (-0.2, -0.5, -1.0))],
        images=[checker()],
    )
