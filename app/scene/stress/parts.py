"""What the stress scenes are built of: meshes from a few numbers, and a stage that collects them. Metres, y up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..decoded import Decoded
from ..model import F64, Environment, Image, Instance, Light, Material, SceneCamera, TextureSlot
from ..validate import RawMesh

Vec3 = tuple[float, float, float]
Rgb = tuple[float, float, float]

BLACK = Environment((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
DAY = Environment()


def matt(color: Rgb, emissive: Rgb = (0.0, 0.0, 0.0)) -> Material:
    """A dull surface that may glow."""
    return Material((*color, 1.0), emissive=emissive)


def camera(focus: float, aperture: float, eye: Vec3 = (0, 0, 0), target: Vec3 = (0, 0, -1), fov: float = 45.0,
           up: Vec3 = (0, 1, 0)) -> SceneCamera:  # fmt: skip
    """A viewpoint, by default from the origin along -z, where a point's depth is its -z exactly."""
    return SceneCamera(eye, target, up, fov, focus, aperture)


def sun(lux: float = 3.0, direction: Vec3 = (-0.4, -0.8, -0.45)) -> Light:
    """White light along a direction of any length."""
    x, y, z = (float(c) for c in np.asarray(direction) / np.linalg.norm(direction))
    return Light("sun", (1.0, 1.0, 1.0), lux, direction=(x, y, z))


def mesh(positions: ArrayLike, triangles: ArrayLike, material: int, normals: ArrayLike | None = None,
         uvs: ArrayLike | None = None) -> RawMesh:  # fmt: skip
    """Arrays of a mesh from anything that numpy makes arrays of."""
    return RawMesh(
        np.asarray(positions, np.float32),
        np.asarray(triangles, np.int64).reshape(-1, 3),
        material,
        None if normals is None else np.asarray(normals, np.float32),
        None if uvs is None else np.asarray(uvs, np.float32),
    )


def card(corner: ArrayLike, u: ArrayLike, v: ArrayLike, material: int, repeat: float = 1.0,
         shift: tuple[float, float] = (0.0, 0.0)) -> RawMesh:  # fmt: skip
    """A parallelogram of two triangles with sides `u`, `v` [m]; its texture repeats along both, shifted by a part."""
    c, u, v = (np.asarray(x, np.float64) for x in (corner, u, v))
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    uvs = repeat * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + np.array(shift)
    return mesh([c, c + u, c + u + v, c + v], [[0, 1, 2], [0, 2, 3]], material, np.tile(normal, (4, 1)), uvs)


def grid(corner: ArrayLike, u: ArrayLike, v: ArrayLike, cells: int) -> tuple[F64, np.ndarray]:
    """Vertices and triangles of a parallelogram in cells x cells squares, diagonals alternating."""
    t = np.linspace(0.0, 1.0, cells + 1)
    a, b = (x.ravel()[:, None] for x in np.meshgrid(t, t))
    positions = np.asarray(corner) + a * np.asarray(u) + b * np.asarray(v)
    i = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    corners = np.stack([i, i + 1, i + cells + 2, i + cells + 1], 1)
    odd = (np.indices((cells, cells)).sum(0) % 2).ravel() == 1
    corners[odd] = np.roll(corners[odd], 1, axis=1)
    return positions, np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def welded(parts: Sequence[tuple[F64, np.ndarray]], material: int) -> RawMesh:
    """Several pieces as one mesh that shares the vertices which coincide exactly, with smooth normals."""
    starts = np.cumsum([0, *(len(p) for p, _ in parts[:-1])])
    positions = np.concatenate([p for p, _ in parts]).astype(np.float32)
    triangles = np.concatenate([t + start for (_, t), start in zip(parts, starts, strict=True)])
    own, renamed = np.unique(positions, axis=0, return_inverse=True)
    return mesh(own, renamed.ravel()[triangles], material)


def closed_box(half: float, cells: int, material: int) -> RawMesh:
    """A cube about the origin whose faces share their edges' vertices."""
    faces = []
    for axis in range(3):
        for side in (-half, half):
            corner, u, v = np.full(3, -half), np.zeros(3), np.zeros(3)
            corner[axis], u[(axis + 1) % 3], v[(axis + 2) % 3] = side, 2 * half, 2 * half
            faces.append(grid(corner, u, v, cells))
    return welded(faces, material)


def ball(radius: float, segments: int, rings: int, material: int) -> RawMesh:
    """A closed sphere about the origin whose poles, fans of slender triangles, lie on the z axis."""
    polar = np.linspace(0.0, np.pi, rings + 1)[1:-1, None]
    around = 2 * np.pi * np.arange(segments) / segments
    body = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around),
                     np.cos(polar) * np.ones(segments)], -1).reshape(-1, 3)  # fmt: skip
    points = np.concatenate([body, [[0, 0, 1], [0, 0, -1]]])
    ring = np.arange(segments)
    beside = (ring + 1) % segments
    first, last = 0, (rings - 2) * segments
    fans = [np.stack([np.full(segments, len(body)), first + ring, first + beside], 1),
            np.stack([np.full(segments, len(body) + 1), last + beside, last + ring], 1)]  # fmt: skip
    for row in range(rings - 2):
        a, b = row * segments + ring, row * segments + beside
        fans += [np.stack([a, a + segments, b], 1), np.stack([b, a + segments, b + segments], 1)]
    return mesh(radius * points, np.concatenate(fans), material, points)


def box(low: ArrayLike, high: ArrayLike, material: int) -> RawMesh:
    """Six flat faces."""
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    faces = []
    for axis in range(3):
        u, v = np.zeros(3), np.zeros(3)
        u[(axis + 1) % 3], v[(axis + 2) % 3] = (high - low)[(axis + 1) % 3], (high - low)[(axis + 2) % 3]
        there = low.copy()
        there[axis] = high[axis]
        faces += [card(low, v, u, material), card(there, u, v, material)]
    return joined(faces)


def joined(meshes: Sequence[RawMesh]) -> RawMesh:
    """Meshes of one material as one; all have normals, and all or none texture coordinates."""
    starts = np.cumsum([0, *(len(m.positions) for m in meshes[:-1])])
    triangles = np.concatenate([m.triangles + start for m, start in zip(meshes, starts, strict=True)])
    uvs = [m.uvs for m in meshes if m.uvs is not None]
    return mesh(
        np.concatenate([m.positions for m in meshes]),
        triangles,
        meshes[0].material,
        np.concatenate([m.normals for m in meshes if m.normals is not None]),
        np.concatenate(uvs) if len(uvs) == len(meshes) else None,
    )


def at(x: float, y: float, z: float, scale: float = 1.0) -> F64:
    """A placement: scaled about the origin, then moved."""
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix


def turned(degrees: float, axis: int = 1) -> F64:
    """A rotation about one of the axes (4, 4)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(4)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def checker(dark: int = 40, light: int = 220, squares: int = 8, side: int = 128) -> Image:
    """A grey checkerboard."""
    cell = side // squares
    value = np.where((np.indices((side, side)) // cell).sum(0) % 2, light, dark).astype(np.uint8)
    return Image(np.dstack([value, value, value, np.full_like(value, 255)]), srgb=True)


def textured(image: int, color: Rgb = (1.0, 1.0, 1.0), cutoff: float | None = None) -> Material:
    """A dull surface with a picture on it, with holes where its alpha is below `cutoff`."""
    return Material((*color, 1.0), alpha_cutoff=cutoff, base_color_texture=TextureSlot(image))


def staged(
    meshes: Sequence[RawMesh],
    materials: Sequence[Material],
    view: SceneCamera,
    *,
    places: Sequence[tuple[int, F64]] | None = None,
    lights: Sequence[Light] = (),
    images: Sequence[Image] = (),
    environment: Environment = DAY,
) -> Decoded:
    """A scene of meshes where they are, or at (mesh, matrix) `places`."""
    placed = places if places is not None else [(i, np.eye(4)) for i in range(len(meshes))]
    return Decoded(
        list(meshes),
        list(materials),
        [Instance(i, matrix) for i, matrix in placed],
        list(images),
        list(lights),
        [view],
        environment,
    )
