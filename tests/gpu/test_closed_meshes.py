"""Nothing escapes a closed mesh, counted on the real traversal: rays from inside, most of them aimed at edges and
vertices, where a ray could slip between two triangles that each leave it to the other.
"""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np
import pytest
import trimesh

from .rays import Mesh
from .test_traverse import as_float32, assert_none_invented, bumpy, moved

BATCH = 250_000
SPHERE = trimesh.creation.icosphere(subdivisions=4)


def fan(closest: float) -> trimesh.Trimesh:
    """Two pyramids base to base over a rim whose corners crowd: triangles up to 1 / `closest` longer than wide."""
    steps = np.geomspace(closest, 0.5, 24)
    quarter = np.concatenate([[0.0], steps, 1.0 - steps[-2::-1]])
    angle = 0.5 * np.pi * (quarter + np.arange(4)[:, None]).ravel()
    rim = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    this = np.arange(len(rim))
    following = np.roll(this, -1)
    above, below = np.full(len(rim), len(rim)), np.full(len(rim), len(rim) + 1)
    faces = np.concatenate([np.column_stack([above, this, following]), np.column_stack([below, following, this])])
    return trimesh.Trimesh(np.vstack([rim, [0, 0, 1], [0, 0, -1]]), faces, process=False)


def turned(points: np.ndarray) -> np.ndarray:
    """By angles that leave no zero in any coordinate."""
    return points @ trimesh.transformations.euler_matrix(0.3, 1.1, 2.3)[:3, :3].T


SHAPES: dict[str, Callable[[], tuple[np.ndarray, np.ndarray]]] = {
    "sphere": lambda: (SPHERE.vertices, SPHERE.faces),
    "bumpy": lambda: (bumpy(SPHERE, np.random.default_rng(4)), SPHERE.faces),
    "flattened": lambda: (SPHERE.vertices * [1, 1e-3, 1], SPHERE.faces),
    "box": lambda: ((b := trimesh.creation.box(extents=[2, 1, 3])).vertices, b.faces),
    "turned box": lambda: (turned((b := trimesh.creation.box(extents=[2, 1, 3])).vertices), b.faces),
    "slivers": lambda: ((f := fan(1e-7)).vertices, f.faces),
    "turned slivers": lambda: (turned((f := fan(1e-6)).vertices), f.faces),
    "odd scale": lambda: (turned(bumpy(SPHERE, np.random.default_rng(5))) * 0.0137, SPHERE.faces),
    "a thousandth": lambda: (bumpy(SPHERE, np.random.default_rng(6)) * 1e-3, SPHERE.faces),
    "ten thousandfold": lambda: (bumpy(SPHERE, np.random.default_rng(7)) * 1e4, SPHERE.faces),
    "far away": lambda: (moved(SPHERE.vertices, 1000, -500, 250), SPHERE.faces),
    "too far for its size": lambda: (moved(turned(SPHERE.vertices), 1e5, 0, -1e5), SPHERE.faces),
}


def rays_inside(
    rng: np.random.Generator, vertices: np.ndarray, faces: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """From the middle or up to half way out, every shape being star-shaped from there: a third at vertices, a third at
    edges, the rest at faces.
    """
    centre = vertices.mean(axis=0)
    start = vertices[rng.integers(0, len(vertices), count)]
    origins = centre + (start - centre) * np.where(rng.random(count) < 0.1, 0, rng.uniform(0, 0.5, count))[:, None]
    weights = rng.dirichlet([1, 1, 1], count)
    weights[: 2 * count // 3, 2] = 0
    weights[: count // 3] = [1, 0, 0]
    weights /= weights.sum(axis=1, keepdims=True)
    targets = np.einsum("ri,rij->rj", weights, vertices[faces[rng.integers(0, len(faces), count)]])
    return tuple(as_float32(origins, targets - origins))  # type: ignore[return-value]


@pytest.mark.parametrize("shape", SHAPES)
def test_nothing_escapes_a_closed_mesh(ctx: moderngl.Context, shape: str, soak: bool) -> None:
    points, faces = SHAPES[shape]()
    vertices = np.asarray(points, np.float32).astype(float)
    mesh = Mesh(ctx, vertices, faces)
    for batch in range(40 if soak else 1):  # ten million rays in all
        count = BATCH if soak else BATCH // 5
        rng = np.random.default_rng([batch, len(faces)])
        origins, directions = rays_inside(rng, vertices, np.asarray(faces), count)
        result = mesh.trace(origins, directions)
        assert result.hit.all(), f"{np.sum(~result.hit)} of {count} rays escaped"
        assert mesh.trace(origins, directions, call="trace_any(ray, t_max)").hit.all()
        if batch == 0:
            assert_none_invented(mesh, origins, directions, result)
    mesh.release()


def test_the_slivers_are_slivers() -> None:
    """Longest edge over smallest height."""
    f = fan(1e-7)
    corners = np.asarray(f.vertices, np.float32).astype(float)[f.faces]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert (edges**2 / area).max() > 1e6
    assert (area > 0).all()
