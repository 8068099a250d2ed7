"""Traversal against Embree and float64: no hit lost, none invented, distances within float32 conditioning."""

from __future__ import annotations

from pathlib import Path

import moderngl
import numpy as np
import pytest
import trimesh

from app.bvh.oracle import brute_force

from .rays import FAR, Mesh, Result, exact, rounding

RAYS = 1_000_000


def unit_vectors(rng: np.random.Generator, count: int) -> np.ndarray:
    v = rng.standard_normal((count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def as_float32(*arrays: np.ndarray) -> list[np.ndarray]:
    return [np.asarray(a, np.float32).astype(float) for a in arrays]


def assert_none_invented(mesh: Mesh, origins: np.ndarray, directions: np.ndarray, result: Result) -> None:
    """Each reported triangle is really there, at the reported distance."""
    o, d, corners = origins[result.hit], directions[result.hit], mesh.corners[result.triangle[result.hit]]
    t, inside = exact(o, d, corners)
    t_error, weight_error = rounding(o, d, corners)
    with np.errstate(invalid="ignore"):
        assert not np.any(inside < -weight_error)
        assert not np.any(np.abs(t - result.t[result.hit]) > t_error)


def assert_none_lost(
    mesh: Mesh, origins: np.ndarray, directions: np.ndarray, result: Result, other_t: np.ndarray, other: np.ndarray
) -> None:
    """Where the other tracer saw a triangle (-1: none) closer than the shader did, it is not really hit there."""
    rays = np.flatnonzero(other >= 0)
    o, d, corners = origins[rays], directions[rays], mesh.corners[other[rays]]
    t, inside = exact(o, d, corners)
    t_error, weight_error = rounding(o, d, corners)
    found = np.where(result.hit, result.t, np.inf)[rays]
    with np.errstate(invalid="ignore"):
        lost = (found > t + 2 * t_error) & (inside > weight_error)
    assert not lost.any(), f"{lost.sum()} of {len(origins)} rays"


def assert_mostly_certain(mesh: Mesh, origins: np.ndarray, directions: np.ndarray, other: np.ndarray) -> None:
    """The tolerances leave something to test: nearly all of the hits lie well inside of their triangles."""
    rays = np.flatnonzero(other >= 0)
    _, inside = exact(origins[rays], directions[rays], mesh.corners[other[rays]])
    _, weight_error = rounding(origins[rays], directions[rays], mesh.corners[other[rays]])
    assert np.mean(inside > weight_error) > 0.99


@pytest.fixture(scope="module")
def room(ctx: moderngl.Context, shared_scenes: Path) -> Mesh:
    geometry = trimesh.load(shared_scenes / "greywhite_room.glb").to_geometry()
    return Mesh(ctx, geometry.vertices, geometry.faces)


def test_real_room_against_embree(room: Mesh) -> None:
    mesh_construction = pytest.importorskip("embreex.mesh_construction")
    from embreex.rtcore_scene import EmbreeScene

    rng = np.random.default_rng(1)
    lo, hi = room.corners.min(axis=(0, 1)), room.corners.max(axis=(0, 1))
    origins, directions = as_float32(rng.uniform(lo, hi, (RAYS, 3)), unit_vectors(rng, RAYS))
    result = room.trace(origins, directions)
    scene = EmbreeScene(robust=True)
    mesh_construction.TriangleMesh(scene, room.corners.astype(np.float32))
    embree = scene.run(origins.astype(np.float32), directions.astype(np.float32), output=True)
    assert result.hit.mean() > 0.5
    assert_mostly_certain(room, origins, directions, embree["primID"])
    assert_none_invented(room, origins, directions, result)
    assert_none_lost(room, origins, directions, result, embree["tfar"], embree["primID"])
    any_hit = room.trace(origins[::5], directions[::5], call="trace_any(ray, t_max)")
    np.testing.assert_array_equal(any_hit.hit, result.hit[::5])


def nasty_corners(rng: np.random.Generator) -> np.ndarray:
    """Slivers, duplicates, zero-area triangles, fans and axis-aligned boxes on integer planes."""
    small = rng.uniform(-4, 4, (150, 1, 3)) + rng.normal(scale=0.5, size=(150, 3, 3))
    thin = [s + rng.uniform(-4, 4, (60, 1, 3)) for s in (sliver(rng, 60, 1e-3), sliver(rng, 60, 1e-5))]
    fan_angle = np.linspace(0, 2 * np.pi, 65)
    rim = np.stack([np.cos(fan_angle), np.sin(fan_angle), 0 * fan_angle], axis=1) * 1.5
    fan = moved(np.stack([np.zeros((64, 3)), rim[:-1], rim[1:]], axis=1), 0, 0, -3)
    flat = np.repeat(rng.uniform(-4, 4, (30, 2, 3)), [2, 1], axis=1)  # two equal corners
    box = trimesh.creation.box(extents=[2, 2, 2]).triangles
    boxes = [moved(box, *centre) for centre in ((-2, 0, 1), (0, 0, 1), (2, 2, -1))]
    corners = np.concatenate([small, *thin, fan, flat, *boxes, small[:40], boxes[0]])
    return corners.astype(np.float32).astype(float)


def moved(points: np.ndarray, *by: float) -> np.ndarray:
    return np.asarray(points) + np.array(by)


def sliver(rng: np.random.Generator, count: int, width: float) -> np.ndarray:
    along, across = unit_vectors(rng, count), unit_vectors(rng, count)
    return np.stack([0 * along, 2 * along, along + width * across], axis=1)


def nasty_rays(rng: np.random.Generator, corners: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Random, axis-aligned (from integer planes, zeros of both signs), and aimed at vertices and edges."""
    origins = rng.uniform(-5, 5, (count, 3))
    directions = unit_vectors(rng, count)
    kind = np.arange(count) % 4
    axis = np.zeros((count, 3))
    axis[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-1.0, 1.0], count)
    axis[axis == 0] = rng.choice([-0.0, 0.0], 2 * count)
    aligned = kind == 1
    directions[aligned] = axis[aligned]
    origins[aligned] = np.where(rng.random((aligned.sum(), 3)) < 0.5, np.round(origins[aligned]), origins[aligned])
    weights = rng.dirichlet([1, 1, 1], count)
    weights[kind == 2] = np.eye(3)[rng.integers(0, 3, (kind == 2).sum())]
    on_edge = kind == 3
    weights[on_edge, 2] = 0
    weights[on_edge] /= weights[on_edge].sum(axis=1, keepdims=True)
    aimed = kind >= 2
    target = np.einsum("ri,rij->rj", weights, corners[rng.integers(0, len(corners), count)])
    directions[aimed] = target[aimed] - origins[aimed]
    return tuple(as_float32(origins, directions))  # type: ignore[return-value]


def test_nasty_mesh_against_float64(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(2)
    corners = nasty_corners(rng)
    mesh = Mesh.of(ctx, corners)
    origins, directions = nasty_rays(rng, corners, 24_000)
    result = mesh.trace(origins, directions)
    truth = brute_force(origins, directions, corners)
    assert_none_invented(mesh, origins, directions, result)
    assert_none_lost(mesh, origins, directions, result, truth.t, truth.triangle)
    mesh.release()


def test_million_random_rays_on_the_nasty_mesh_are_all_really_hit(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(3)
    mesh = Mesh.of(ctx, nasty_corners(rng))
    origins, directions = nasty_rays(rng, mesh.corners, RAYS)
    result = mesh.trace(origins, directions)
    assert 0.3 < result.hit.mean() < 1
    assert_none_invented(mesh, origins, directions, result)
    mesh.release()


def bumpy(sphere: trimesh.Trimesh, rng: np.random.Generator) -> np.ndarray:
    return np.asarray(sphere.vertices) * rng.uniform(0.8, 1.2, (len(sphere.vertices), 1))


def test_axis_aligned_rays_stay_inside_an_axis_aligned_box(ctx: moderngl.Context) -> None:
    """Directions with exact zeros, origins on the planes and diagonals of the faces: 0 * inf must not appear."""
    box = trimesh.creation.box(extents=[2, 2, 2])
    mesh = Mesh(ctx, box.vertices, box.faces)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    origins, directions = (a.reshape(-1, 3) for a in np.broadcast_arrays(grid[:, None], axes[None]))
    result = mesh.trace(origins, directions)
    assert result.hit.all()
    beyond = np.einsum("ri,ri->r", origins, directions)
    travels_in_face = (np.abs(origins) == 1) & (directions == 0)
    inside = ~travels_in_face.any(axis=1) & (beyond > -1)
    np.testing.assert_array_equal(result.t[inside], (1 - beyond)[inside])
    mesh.release()


def scattered(rng: np.random.Generator, shape: str) -> np.ndarray:
    """(500, 3, 3) random triangles."""
    corners = rng.uniform(-4, 4, (500, 1, 3)) + rng.normal(scale=0.4, size=(500, 3, 3))
    return {
        "plain": lambda: corners,
        "huge": lambda: corners * 1e8,
        "tiny": lambda: corners * 1e-12,
        "a thousandth": lambda: corners * 1e-3,
        "ten thousandfold": lambda: corners * 1e4,
        "far away": lambda: moved(corners, 3000, -1000, 500),
        "too far for its size": lambda: moved(corners, 1e5, 0, -1e5),
        "one step of float32": lambda: 1e-3 * corners + 2.0**14,
        "uneven": lambda: corners * [1e5, 1, 1e-5],
        "sheets": lambda: np.where(rng.random((500, 1, 3)) < 0.5, np.round(corners[:, :1]), corners),
        "one plane": lambda: corners * [1, 1, 0] + [0, 0, 0.3],
    }[shape]()


@pytest.mark.parametrize("textures", [False, True], ids=["blocks", "textures"])
@pytest.mark.parametrize(
    "shape",
    [
        "plain",
        "huge",
        "tiny",
        "a thousandth",
        "ten thousandfold",
        "far away",
        "too far for its size",
        "one step of float32",
        "uneven",
        "sheets",
        "one plane",
    ],
)
def test_scattered_triangles_against_float64(ctx: moderngl.Context, shape: str, textures: bool) -> None:
    rng = np.random.default_rng(7)
    corners = scattered(rng, shape).astype(np.float32).astype(float)
    mesh = Mesh(ctx, corners.reshape(-1, 3), np.arange(1500).reshape(-1, 3), textures=textures)
    low, size = corners.min(axis=(0, 1)), np.ptp(corners, axis=(0, 1))
    origins = low + rng.uniform(-0.2, 1.2, (8000, 3)) * np.maximum(size, 0.1 * size.max() if shape != "uneven" else 0)
    targets = np.einsum("ri,rij->rj", rng.dirichlet([1, 1, 1], 8000), corners[rng.integers(0, 500, 8000)])
    origins, directions = as_float32(origins, targets - origins)
    result = mesh.trace(origins, directions)
    truth = brute_force(origins, directions, corners)
    assert_none_invented(mesh, origins, directions, result)
    assert_none_lost(mesh, origins, directions, result, truth.t, truth.triangle)
    assert result.hit.mean() > 0.5
    mesh.release()


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_tiny_trees(ctx: moderngl.Context, count: int) -> None:
    triangle = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], float)
    mesh = Mesh.of(ctx, np.stack([moved(triangle, 0, 0, i) for i in range(count)]) if count else np.zeros((0, 3, 3)))
    origins = np.array([[0, 0, -1.0], [0, 0, count + 1.0], [5, 5, -1]])
    result = mesh.trace(origins, np.array([[0, 0, 1.0], [0, 0, -1], [0, 0, 1]]))
    np.testing.assert_array_equal(result.hit, [count > 0, count > 0, False])
    if count:
        np.testing.assert_array_equal(result.t[:2], [1, 2])
        np.testing.assert_array_equal(result.triangle[:2], [0, count - 1])
    mesh.release()


def test_only_hits_between_t_min_and_t_max_count(ctx: moderngl.Context) -> None:
    triangle = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], float)
    mesh = Mesh.of(ctx, np.stack([moved(triangle, 0, 0, z) for z in (1, 2, 3)]))
    ray = np.zeros((1, 3)), np.array([[0, 0, 2.0]])  # t counts in lengths of the direction
    cases = [(0, FAR, 0.5), (0.5, FAR, 0.5), (0.6, FAR, 1), (0, 0.4, None), (1.1, 1.4, None), (1.2, 1.5, 1.5)]
    for t_min, t_max, expected in cases:
        closest = mesh.trace(*ray, t_min, t_max)
        assert (closest.t[0] if closest.hit[0] else None) == expected
        assert mesh.trace(*ray, t_min, t_max, call="trace_any(ray, t_max)").hit[0] == (expected is not None)
    mesh.release()
