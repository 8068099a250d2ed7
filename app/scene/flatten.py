"""Bakes the instances of a scene into one triangle list, the form that raster and rays share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from . import geometry
from .model import F64, Instance, Mesh, MovingObject, Scene, Triangles
from .motion import Motion, displacements


def flatten(scene: Scene) -> Triangles:
    """Arrays of all instances, those that stand still first; triangles that collapse on the way are dropped.

    Triangle order is kept under mirroring: surfaces are two-sided, nothing here or later reads the winding.
    """
    origin = geometry.local_origin(*rest_box(scene.meshes, scene.instances))
    standing = [_place(scene.meshes[i.mesh], i, 0, origin) for i in scene.instances if i.motion is None]
    parts, moving = [*standing], list[MovingObject]()
    for motion in dict.fromkeys(i.motion for i in scene.instances if i.motion is not None):
        index = len(moving) + 1
        together = [_place(scene.meshes[i.mesh], i, index, origin) for i in scene.instances if i.motion is motion]
        body, centred = _moving_object(motion, together, origin)
        parts += centred
        moving.append(body)
    return replace(_merged(parts), moving=tuple(moving), origin=origin) if parts else _EMPTY


def rest_box(meshes: Sequence[Mesh], instances: Sequence[Instance]) -> tuple[F64, F64]:
    """(lowest, highest) corner of a box around the boxes of all instances at time 0, m, world; both zero for none."""
    own = [(m.positions.min(axis=0), m.positions.max(axis=0)) if len(m.positions) else None for m in meshes]
    ends = []
    for instance in instances:
        if (box := own[instance.mesh]) is not None:
            linear = instance.transform[:3, :3]
            middle, half = (0.5 * (box[1].astype(np.float64) + sign * box[0]) for sign in (1.0, -1.0))
            centre, reach = linear @ middle + instance.transform[:3, 3], np.abs(linear) @ half
            ends.append((centre - reach, centre + reach))
    if not ends:
        return np.zeros(3), np.zeros(3)
    lows, highs = (np.stack(side) for side in zip(*ends, strict=True))
    return lows.min(axis=0), highs.max(axis=0)


def bounds(triangles: Triangles) -> tuple[F64, F64]:
    """(lowest, highest) corner of a box around all that the scene passes through in the world, m; both zero for none.

    Exactly that of the vertices where nothing moves.
    """
    standing = triangles.positions[triangles.objects == 0] + triangles.origin
    corners = np.concatenate([standing, *([m.low, m.high] for m in triangles.moving)])
    return (corners.min(axis=0), corners.max(axis=0)) if len(corners) else (np.zeros(3), np.zeros(3))


def places(moving: Sequence[MovingObject], time_s: float) -> F64:
    """(k, 4, 4) each object's own space to the world at a time."""
    matrices = displacements([m.motion for m in moving], time_s)
    matrices[:, :3, 3] += np.einsum("kij,kj->ki", matrices[:, :3, :3], np.stack([m.origin for m in moving]))
    return matrices


def triangles_of(triangles: Triangles) -> list[int]:
    """How many triangles each moving object has."""
    counts = np.bincount(triangles.objects[triangles.indices[:, 0]], minlength=len(triangles.moving) + 1)
    return [int(count) for count in counts[1:]]


def _merged(parts: list[Triangles]) -> Triangles:
    counts = [len(p.positions) for p in parts]
    starts = np.cumsum([0, *counts[:-1]]).astype(np.uint32)
    indices = np.concatenate([p.indices + start for p, start in zip(parts, starts, strict=True)])
    positions = np.concatenate([p.positions for p in parts])
    return Triangles(
        positions,
        np.concatenate([p.normals for p in parts]),
        np.concatenate([p.uvs for p in parts]),
        np.concatenate([p.tangents for p in parts]),
        np.concatenate([p.materials for p in parts]),
        np.ascontiguousarray(indices[~geometry.degenerate(positions, indices)]),
        np.concatenate([p.objects for p in parts]),
    )


def _moving_object(motion: Motion, parts: list[Triangles], origin: F64) -> tuple[MovingObject, list[Triangles]]:
    """What moves as one, and its triangles in its own space; `parts` are where time 0 has them, about `origin`."""
    positions = np.concatenate([p.positions for p in parts]).astype(np.float64)
    low, high = positions.min(axis=0), positions.max(axis=0)
    middle = 0.5 * (low + high)
    centred = [replace(p, positions=(p.positions - middle).astype(np.float32)) for p in parts]
    half_size = np.abs(np.concatenate([p.positions for p in centred])).max(axis=0).astype(np.float64)
    middle += origin
    return MovingObject(motion, middle, half_size, *motion.swept(middle - half_size, middle + half_size)), centred


def _positions(mesh: Mesh, instance: Instance, origin: F64) -> F64:
    return mesh.positions @ instance.transform[:3, :3].T + (instance.transform[:3, 3] - origin)


def _place(mesh: Mesh, instance: Instance, index: int, origin: F64) -> Triangles:
    """One mesh about the scene's origin. Normals go by the cofactors: the inverse transpose, up to scale."""
    linear = instance.transform[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # a scale of 1e300 along an axis in which the mesh is flat
        cofactor = _cofactor(linear)
        flip = -1.0 if cofactor[0] @ linear[0] < 0.0 else 1.0  # the determinant
        # The sign turns the cofactor of a mirror back into its inverse transpose.
        normals = geometry.unit(mesh.normals @ (flip * cofactor).T)
    positions = _positions(mesh, instance, origin).astype(np.float32)
    lost = ~normals.any(axis=1)
    if lost.any():  # a mesh pressed flat: at its rim, normals lie in its plane
        normals[lost] = geometry.area_weighted_normals(positions, mesh.triangles)[lost]
    tangents = np.hstack([geometry.unit(mesh.tangents[:, :3] @ linear.T), flip * mesh.tangents[:, 3:]])
    return Triangles(
        positions,
        normals.astype(np.float32),
        mesh.uvs,
        tangents.astype(np.float32),
        np.full(len(mesh.positions), mesh.material, np.uint32),
        mesh.triangles,
        np.full(len(mesh.positions), index, np.uint32),
    )


def _cofactor(m: F64) -> F64:
    return geometry.cross(m[[1, 2, 0]], m[[2, 0, 1]])


_EMPTY = Triangles(
    np.zeros((0, 3), np.float32),
    np.zeros((0, 3), np.float32),
    np.zeros((0, 2), np.float32),
    np.zeros((0, 4), np.float32),
    np.zeros(0, np.uint32),
    np.zeros((0, 3), np.uint32),
    np.zeros(0, np.uint32),
)
