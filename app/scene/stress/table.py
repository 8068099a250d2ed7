"""One scene at any scale and place: balls and blades on a chequered floor, a near leaf, a sun and a lamp.

Its picture depends on neither, if aperture and focus are scaled along: what differs is what arithmetic lost.
"""

from __future__ import annotations

import numpy as np

from ..decoded import Decoded
from ..model import Instance, Light
from .parts import Vec3, at, ball, box, camera, card, checker, matt, staged, sun, textured

FOCUS, APERTURE = 2.0, 0.06  # m, at scale 1


def make(scale: float = 1.0, origin: Vec3 = (0.0, 0.0, 0.0)) -> Decoded:
    """The scene `scale` times as large, with its middle at `origin` [m]."""
    colors = ((0.7, 0.15, 0.1), (0.15, 0.5, 0.2), (0.1, 0.25, 0.7), (0.8, 0.6, 0.2))
    materials = [*(matt(c) for c in colors), textured(0), matt((0.1, 0.1, 0.1), (3.0, 2.5, 1.5))]
    meshes = [
        card((-3, 0, 2), (6, 0, 0), (0, 0, -8), 4, repeat=4.0),
        *(ball(0.3, 32, 20, k) for k in range(3)),
        *(box((0.3 * k - 0.62, 0, -0.01), (0.3 * k - 0.6, 0.9, 0.01), 3) for k in range(5)),
        box((-0.05, 0, -0.05), (0.05, 1.4, 0.05), 5),
        card((0.18, 0.55, 1.3), (0.25, 0.05, 0.02), (-0.1, 0.3, 0.0), 1),
    ]
    places = [at(0, 0, 0), at(-0.7, 0.3, 0.1), at(0.2, 0.3, -1.2), at(0.9, 0.3, -3.0)]
    places += [at(0, 0, -0.6)] * 5 + [at(-1.2, 0, -2.5), at(0, 0, 0)]
    eye = np.array([0.15, 0.75, 2.0])
    target = np.array([0.0, 0.45, 0.0])
    moved = [np.asarray(origin) + scale * p for p in (eye, target, np.array([0.8, 1.5, 1.0]))]
    view = camera(scale * FOCUS, scale * APERTURE, _tuple(moved[0]), _tuple(moved[1]))
    lamp = Light("point", (1.0, 0.8, 0.6), 2.0 * scale * scale, position=_tuple(moved[2]))
    made = staged(meshes, materials, view, images=[checker()], lights=[sun(2.5), lamp])
    world = at(*origin, scale=scale)
    made.instances = [Instance(i, world @ place) for i, place in enumerate(places)]
    return made


def _tuple(v: np.ndarray) -> Vec3:
    x, y, z = (float(c) for c in v)
    return x, y, z
