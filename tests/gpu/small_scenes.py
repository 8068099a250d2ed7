"""Small scenes made in code: quads with a material each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.scene.model import Image, Instance, Light, Material, Mesh, Scene
from app.scene.motion import Joint, Motion, Track, unit_quaternions

Vec3 = tuple[float, float, float]


def quad(corner: Vec3, edge_u: Vec3, edge_v: Vec3, material: int = 0, flip_winding: bool = False) -> Mesh:
    """A parallelogram whose normal is edge_u x edge_v; uv runs 0..1 along the edges."""
    c, u, v = (np.asarray(x, float) for x in (corner, edge_u, edge_v))
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    return Mesh(
        positions=np.array([c, c + u, c + u + v, c + v], np.float32),
        normals=np.tile(normal, (4, 1)).astype(np.float32),
        uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32),
        tangents=np.tile([*(u / np.linalg.norm(u)), 1.0], (4, 1)).astype(np.float32),
        triangles=triangles[:, ::-1].copy() if flip_winding else triangles,
        material=material,
    )


def scene_of(
    meshes: Sequence[Mesh],
    materials: Sequence[Material] = (Material(),),
    images: Sequence[Image] = (),
    lights: Sequence[Light] = (),
) -> Scene:
    """The meshes where they are."""
    instances = tuple(Instance(i, np.eye(4)) for i in range(len(meshes)))
    return Scene(tuple(meshes), tuple(materials), instances, tuple(images), tuple(lights))


def moving(
    scene: Scene,
    *indices: int,
    period: float = 4.0,
    slide: Sequence[Vec3] = ((0, 0, 0),),
    turns: Sequence[tuple[float, float, float, float]] = ((0, 0, 0, 1),),
    pivot: Vec3 = (0, 0, 0),
) -> Scene:
    """The scene with some of its meshes moving as one: slid through evenly timed offsets [m], turned about the pivot
    through evenly timed quaternions (x, y, z, w), from time 0 to the period.
    """
    base = np.eye(4)
    base[:3, 3] = pivot
    tracks = [
        Track(np.linspace(0.0, period, len(values)) if len(values) > 1 else np.zeros(1), np.asarray(values, float))
        for values in (slide, unit_quaternions(turns))
    ]
    motion = Motion((Joint(base, *tracks, np.ones(3)),), period)
    instances = tuple(replace(i, motion=motion if i.mesh in indices else i.motion) for i in scene.instances)
    return replace(scene, instances=instances)


def about(axis: Vec3, degrees: float) -> tuple[float, float, float, float]:
    """The quaternion of a rotation about a unit axis."""
    half = np.radians(degrees) / 2
    x, y, z = np.sin(half) * np.asarray(axis, float)
    return x, y, z, float(np.cos(half))


def checker(side: int, dark: int, light: int, alpha: bool = False) -> Image:
    """Texel checkerboard; with `alpha` the dark texels are holes."""
    odd = np.indices((side, side)).sum(0) % 2
    value = np.where(odd, light, dark).astype(np.uint8)
    opaque = np.where(odd | (not alpha), 255, 0).astype(np.uint8)
    return Image(np.dstack([value, value, value, opaque]), srgb=True)
