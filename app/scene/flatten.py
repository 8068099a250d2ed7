"""Bakes the instances of a scene into one world-space triangle list, the form that raster and rays share."""

from __future__ import annotations

import numpy as np

from . import geometry
from .model import F64, Instance, Mesh, Scene, Triangles


def flatten(scene: Scene) -> Triangles:
    """World-space arrays of all instances, in instance order; triangles that collapse on the way are dropped.

    Triangle order is kept under mirroring: surfaces are two-sided, nothing here or later reads the winding.
    """
    placed = [_place(scene.meshes[i.mesh], i) for i in scene.instances]
    if not placed:
        return _EMPTY
    counts = [len(p.positions) for p in placed]
    starts = np.cumsum([0, *counts[:-1]]).astype(np.uint32)
    indices = np.concatenate([p.indices + start for p, start in zip(placed, starts, strict=True)])
    positions = np.concatenate([p.positions for p in placed])
    indices = indices[~geometry.degenerate(positions, indices)]
    return Triangles(
        positions,
        np.concatenate([p.normals for p in placed]),
        np.concatenate([p.uvs for p in placed]),
        np.concatenate([p.tangents for p in placed]),
        np.concatenate([p.materials for p in placed]),
        np.ascontiguousarray(indices),
    )


def bounds(triangles: Triangles) -> tuple[F64, F64]:
    """(lowest, highest) corner of the world-space box around all vertices, m; both zero for none."""
    if not len(triangles.positions):
        return np.zeros(3), np.zeros(3)
    return triangles.positions.min(axis=0).astype(np.float64), triangles.positions.max(axis=0).astype(np.float64)


def _positions(mesh: Mesh, instance: Instance) -> F64:
    return mesh.positions @ instance.transform[:3, :3].T + instance.transform[:3, 3]


def _place(mesh: Mesh, instance: Instance) -> Triangles:
    """One mesh in the world. Normals go by the cofactors: the inverse transpose, up to scale."""
    linear = instance.transform[:3, :3]
    flip = -1.0 if np.linalg.det(linear) < 0.0 else 1.0
    cofactor = flip * _cofactor(linear)  # the sign turns the cofactor of a mirror back into its inverse transpose
    normals = geometry.unit(mesh.normals @ cofactor.T)
    tangents = np.hstack([geometry.unit(mesh.tangents[:, :3] @ linear.T), flip * mesh.tangents[:, 3:]])
    return Triangles(
        _positions(mesh, instance).astype(np.float32),
        normals.astype(np.float32),
        mesh.uvs,
        tangents.astype(np.float32),
        np.full(len(mesh.positions), mesh.material, np.uint32),
        mesh.triangles,
    )


def _cofactor(m: F64) -> F64:
    return np.stack([np.cross(m[1], m[2]), np.cross(m[2], m[0]), np.cross(m[0], m[1])])


_EMPTY = Triangles(
    np.zeros((0, 3), np.float32),
    np.zeros((0, 3), np.float32),
    np.zeros((0, 2), np.float32),
    np.zeros((0, 4), np.float32),
    np.zeros(0, np.uint32),
    np.zeros((0, 3), np.uint32),
)
