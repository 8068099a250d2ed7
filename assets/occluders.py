"""What hangs between the lens and the still life, placed in camera space: a leafy branch and a woven wire screen."""

from __future__ import annotations

import itertools

import numpy as np
import shapes
import textures
from glb import GlbWriter
from numpy.typing import NDArray
from staging import material

F64 = NDArray[np.float64]

SEED = 3  # of those tried, the branch whose leaves hang across the vase's neck and belly


def twig(start: F64, direction: F64, length: float, droop: float, points: int) -> F64:
    """A path that leaves along `direction` and bends downwards by `droop` of its length."""
    t = np.linspace(0.0, 1.0, points)[:, None]
    return start + shapes.unit(direction) * length * t + np.array([0.0, -droop * length, 0.0]) * t**2


def stand_on(path: F64, at: int, sideways: F64, roll: float, scale: float) -> F64:
    """A leaf's frame at a point of a twig: pointing sideways, rolled about its own axis [rad]."""
    y = shapes.unit(sideways)
    x = shapes.unit(np.cross(y, [0.0, 0.0, 1.0]))
    z = np.cross(x, y)
    c, s = np.cos(roll), np.sin(roll)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([c * x - s * z, y, s * x + c * z], 1) * scale
    matrix[:3, 3] = path[at]
    return matrix


def build_branch(writer: GlbWriter, camera: F64, clamp: int) -> None:
    """A branch that enters from the upper left, about half a metre before the lens, drawn in camera space."""
    random = np.random.Generator(np.random.PCG64(SEED))
    bark = material(writer, "bark", (0.16, 0.10, 0.06), 0.0, 0.85)
    foliage = writer.texture("leaf", textures.leaf(256), clamp)
    mask = {"alphaMode": "MASK", "alphaCutoff": 0.5}
    green = material(writer, "leaf", (1, 1, 1), 0.0, 0.5, texture={"index": foliage}, **mask)
    leaf = writer.mesh("leaf", shapes.leaf_card(0.050, 0.029, 0.22), green)

    main = shapes.spline(
        np.array(
            [
                [-0.38, 0.16, -0.56],
                [-0.22, 0.108, -0.51],
                [-0.07, 0.088, -0.47],
                [0.06, 0.068, -0.44],
                [0.14, 0.03, -0.46],
            ]
        ),
        60,
    )
    stems = [shapes.tube(main, np.linspace(0.0055, 0.0014, len(main)), 8)]
    for k, at in enumerate(range(6, len(main) - 2, 4)):
        up = 1.0 if k % 2 else -1.0
        ahead = shapes.unit(main[at + 1] - main[at])
        direction = ahead + np.array([0.0, 0.9 * up, 0.0]) + random.normal(0.0, 0.25, 3) * [1.0, 1.0, 0.8]
        path = twig(main[at], direction, random.uniform(0.06, 0.12) * (1.0 - 0.4 * at / len(main)), 0.25, 14)
        stems.append(shapes.tube(path, np.linspace(0.0016, 0.0006, len(path)), 6))
        for side, spot in enumerate((3, 5, 7, 9, 11, 13)):
            forward = shapes.unit(path[-1] - path[0])
            across = np.cross(forward, [0.0, 0.0, 1.0]) * (1.0 if side % 2 else -1.0) * (0.0 if spot == 13 else 1.0)
            sideways = forward * 0.7 + across + random.normal(0.0, 0.22, 3)
            frame = stand_on(path, spot, sideways, random.normal(0.0, 0.7), random.uniform(0.6, 1.0))
            writer.node("leaf", camera @ frame, mesh=leaf)
    writer.node("branch", camera, mesh=writer.mesh("branch", shapes.merge(stems), bark))


def build_screen(writer: GlbWriter, camera: F64) -> None:
    """A woven wire screen in the lower right corner, about 0.7 m before the lens, in camera space."""
    wire = material(writer, "wire", (0.72, 0.45, 0.30), 1.0, 0.3)
    pitch, thickness, size = 0.026, 0.0011, 12
    t = np.linspace(0.0, 1.0, 8 * size + 1)
    wires = []
    for k in range(size + 1):
        weave = thickness * np.sin(np.pi * (t * size + k))  # over one wire, under the next
        fixed = np.full_like(t, k * pitch)
        wires.append(np.stack([t * size * pitch, fixed, weave], 1))
        wires.append(np.stack([fixed, t * size * pitch, -weave], 1))
    rim = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * size * pitch
    tubes = [shapes.tube(path[::2], thickness, 5) for path in wires]
    frame = [shapes.tube(np.linspace([*a, 0.0], [*b, 0.0], 3), 0.004, 10) for a, b in itertools.pairwise(rim)]
    stand = np.eye(4)
    c, s = np.cos(0.5), np.sin(0.5)
    stand[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    stand[:3, 3] = (0.27, -0.31, -0.70)
    writer.node("screen", camera @ stand, mesh=writer.mesh("screen", shapes.merge(tubes + frame), wire))
