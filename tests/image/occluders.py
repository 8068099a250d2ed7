"""Closed coloured solids on a ground plane, before and behind focus, that hide parts of each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from app.camera import Camera, look_at
from app.scene.model import Instance, Material, Mesh, Scene

Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Solid:
    """A closed mesh with outward faces and one colour."""

    shape: trimesh.Trimesh
    color: Vec3


EYE, TARGET, FOV_Y_DEG = (0.35, 0.62, 3.1), (0.05, 0.33, 0.0), 24.0  # a small field of view, and nothing centred
FOCUS, APERTURE = 3.0, 0.16  # m
BACKGROUND = (0.21, 0.34, 0.55)
CAMERA: Camera = look_at(EYE, TARGET, fov_y_deg=FOV_Y_DEG)


def _placed(shape: trimesh.Trimesh, at: Vec3, color: Vec3, turn: float = 0.0) -> Solid:
    shape.apply_transform(trimesh.transformations.rotation_matrix(turn, (0.3, 1.0, 0.2)))
    shape.apply_translation(at)
    return Solid(shape, color)


def solids() -> list[Solid]:
    """Near bars and a near ball that the lens looks around, a sharp subject, and what they hide."""
    box, ball = trimesh.creation.box, trimesh.creation.icosphere
    return [
        _placed(box((9.0, 0.1, 9.0)), (0.0, -0.05, -2.0), (0.32, 0.25, 0.18)),
        _placed(box((0.3, 0.4, 0.3)), (-0.25, 0.22, 0.1), (0.8, 0.12, 0.1), 0.5),
        _placed(ball(2, 0.2), (0.28, 0.22, 0.15), (0.1, 0.65, 0.22)),
        _placed(box((0.9, 0.9, 0.2)), (-0.9, 0.45, -2.6), (0.9, 0.8, 0.15), 0.2),
        _placed(ball(2, 0.35), (0.55, 0.4, -3.4), (0.75, 0.2, 0.8)),
        _placed(box((0.03, 0.7, 0.03)), (0.14, 0.45, 1.4), (0.05, 0.1, 0.85), 0.3),
        _placed(box((0.03, 0.9, 0.03)), (0.32, 0.5, 1.7), (0.95, 0.95, 0.9), -0.2),
        _placed(ball(2, 0.07), (-0.02, 0.52, 1.6), (0.1, 0.6, 0.7)),
    ]


def scene() -> Scene:
    """The solids as our own data model."""
    materials = tuple(Material(base_color=(*solid.color, 1.0)) for solid in solids())
    meshes = tuple(_mesh(solid.shape, i) for i, solid in enumerate(solids()))
    return Scene(meshes, materials, tuple(Instance(i, np.eye(4)) for i in range(len(meshes))))


def _mesh(shape: trimesh.Trimesh, material: int) -> Mesh:
    count = len(shape.vertices)
    return Mesh(
        positions=shape.vertices.astype(np.float32),
        normals=np.tile(np.float32([0.0, 1.0, 0.0]), (count, 1)),  # unlit: nothing reads them
        uvs=np.zeros((count, 2), np.float32),
        tangents=np.zeros((count, 4), np.float32),
        triangles=shape.faces.astype(np.uint32),
        material=material,
    )
