"""Parametric surfaces for the built-in scenes: lathe, tube, box, card. Metres, y up, v down the texture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class Shape:
    """Indexed triangles with smooth normals and texture coordinates."""

    positions: F64  # (n, 3)
    normals: F64  # (n, 3) unit
    uvs: F64  # (n, 2)
    triangles: NDArray[np.int64]  # (m, 3)


def unit(v: F64) -> F64:
    """Rows scaled to length 1."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def grid_triangles(rows: int, columns: int) -> NDArray[np.int64]:
    """Two triangles for each cell of a (rows x columns) grid of vertices."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + 1, corner + columns, corner + columns + 1
    return np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])


def merge(shapes: list[Shape]) -> Shape:
    """Several shapes as one."""
    starts = np.cumsum([0] + [len(s.positions) for s in shapes[:-1]])
    return Shape(
        np.concatenate([s.positions for s in shapes]),
        np.concatenate([s.normals for s in shapes]),
        np.concatenate([s.uvs for s in shapes]),
        np.concatenate([s.triangles + start for s, start in zip(shapes, starts, strict=True)]),
    )


def spline(points: F64, samples: int) -> F64:
    """Catmull-Rom curve through (k, d) points, sampled evenly in its parameter."""
    p = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    t = np.linspace(0.0, len(points) - 1, samples)
    i = np.minimum(t.astype(int), len(points) - 2)
    f = (t - i)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    return 0.5 * (2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f**2 + (3 * b - a - 3 * c + d) * f**3)


def lathe(profile: F64, segments: int, repeat: float = 1.0) -> Shape:
    """Surface of revolution of (k, 2) points (radius, height), from bottom to top; u runs `repeat` times around."""
    r, y = np.maximum(profile[:, 0], 0.0), profile[:, 1]
    slope = np.gradient(profile, axis=0)
    out = unit(np.stack([slope[:, 1], -slope[:, 0]], 1))
    angle = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    c, s = np.cos(angle), np.sin(angle)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    v = 1.0 - length / length[-1]
    rows, columns = len(r), segments + 1
    position = np.stack([np.outer(r, s), np.outer(y, np.ones(columns)), np.outer(r, c)], -1)
    normal = np.stack([np.outer(out[:, 0], s), np.outer(out[:, 1], np.ones(columns)), np.outer(out[:, 0], c)], -1)
    uv = np.stack(np.broadcast_arrays(repeat * angle / (2.0 * np.pi), v[:, None]), -1)
    return _without_poles(
        Shape(*(a.reshape(-1, a.shape[-1]) for a in (position, normal, uv)), grid_triangles(rows, columns))
    )


def _without_poles(shape: Shape) -> Shape:
    """Drop the triangles that a lathe collapses where its profile touches the axis."""
    p = np.round(shape.positions, 6)
    a, b, c = (p[shape.triangles[:, i]] for i in range(3))
    solid = (a != b).any(1) & (b != c).any(1) & (c != a).any(1)
    return Shape(shape.positions, shape.normals, shape.uvs, shape.triangles[solid])


def sphere(radius: float, segments: int, rings: int, repeat: float = 1.0) -> Shape:
    """A ball around the origin."""
    t = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    return lathe(radius * np.stack([np.cos(t), np.sin(t)], 1), segments, repeat)


def tube(path: F64, radius: F64 | float, sides: int, uv_per_metre: float = 10.0) -> Shape:
    """A round wire along (k, 3) points with one radius or one for each; frames carried by parallel transport."""
    tangent = unit(np.gradient(path, axis=0))
    side = np.cross(tangent[0], [0.0, 1.0, 0.0] if abs(tangent[0, 1]) < 0.9 else [1.0, 0.0, 0.0])
    sides_along = []
    for t in tangent:
        side = unit(side - t * (side @ t))
        sides_along.append(side)
    x = np.array(sides_along)
    y = np.cross(tangent, x)
    angle = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    normal = x[:, None] * np.cos(angle)[:, None] + y[:, None] * np.sin(angle)[:, None]
    position = path[:, None] + np.broadcast_to(radius, len(path))[:, None, None] * normal
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]) * uv_per_metre
    uv = np.stack(np.broadcast_arrays(angle / (2.0 * np.pi), along[:, None]), -1)
    triangles = grid_triangles(len(path), sides + 1)
    return Shape(position.reshape(-1, 3), normal.reshape(-1, 3), uv.reshape(-1, 2), triangles)


def quad(corner: F64, along_u: F64, along_v: F64, uv_size: tuple[float, float], cells: int = 1) -> Shape:
    """A flat patch from its texture's top left corner; `uv_size` counts texture repeats along each side."""
    t = np.linspace(0.0, 1.0, cells + 1)
    u, v = (a.ravel()[:, None] for a in np.meshgrid(t, t))
    normal = unit(np.cross(along_v, along_u))
    positions = corner + u * along_u + v * along_v
    uvs = np.hstack([u * uv_size[0], v * uv_size[1]])
    return Shape(positions, np.tile(normal, (len(u), 1)), uvs, grid_triangles(cells + 1, cells + 1))


def box(low: F64, high: F64, uv_per_metre: float = 1.0) -> Shape:
    """Six faces, textured by their size."""
    size, center = high - low, (low + high) / 2
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            n, u = np.zeros(3), np.zeros(3)
            n[axis], u[(axis + 1) % 3] = sign, 1.0
            v = np.cross(u, n)  # so that cross(v, u) points outwards
            extent = (abs(u @ size) * uv_per_metre, abs(v @ size) * uv_per_metre)
            corner = center + n * size / 2 - u * size / 2 - v * size / 2
            faces.append(quad(corner, u * size, v * size, extent))
    return merge(faces)


def leaf_card(length: float, width: float, bend: float, cells: int = 4) -> Shape:
    """A card from the origin along +y, arched towards -z by `bend` (of its length) and folded along its rib."""
    t = np.linspace(0.0, 1.0, cells + 1)
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0.0, 1.0, 3), t))
    fold = 0.12 * width * np.abs(2 * u - 1)
    positions = np.stack([(u - 0.5) * width, length * (1 - v), fold - bend * length * (1 - v) ** 2], 1)
    slope = 2 * bend * (1 - v)
    normals = unit(np.stack([-0.24 * np.sign(2 * u - 1), slope, np.ones_like(u)], 1))
    return Shape(positions, normals, np.stack([u, v], 1), grid_triangles(cells + 1, 3))
