"""Rays among moving objects: the two levels see what one flat list of world triangles holds, at every time."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
import trimesh

from app.bvh.oracle import brute_force
from app.scene.flatten import places
from app.scene.model import Mesh, Scene

from .rays import ULP, MovingMesh, Result, exact, rounding
from .small_scenes import about, moving, quad, scene_of
from .test_traverse import as_float32, bumpy, unit_vectors

TIMES = (0.0, 0.37, 1.9, 3.3, 101.25)


def body(points: np.ndarray, faces: np.ndarray) -> Mesh:
    count = len(points)
    up, uv = np.tile([0, 1, 0], (count, 1)), np.zeros((count, 2))
    arrays = (np.asarray(a, np.float32) for a in (points, up, uv, np.zeros((count, 4))))
    return Mesh(*arrays, np.asarray(faces, np.uint32), 0)


def ball(rng: np.random.Generator, centre: tuple[float, ...], subdivisions: int = 3) -> Mesh:
    sphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    return body(bumpy(sphere, rng) + centre, sphere.faces)


def spot(far: float, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> tuple[float, float, float]:
    """A place around a middle that lies `far` from the world's origin."""
    return far + x, -far + y, 0.5 * far + z


def fair(rng: np.random.Generator, far: float = 0.0) -> Scene:
    """Walls and a ball that stand still; balls that slide, spin, and circle; a flat quad that turns; `far` from the
    world's origin.
    """
    walls = [quad(spot(far, -5, -3, -5), (10, 0, 0), edge) for edge in ((0, 0, 10), (0, 6, 0))]
    balls = [ball(rng, spot(far, *c)) for c in ((-3, 0, 0), (3, 0, 0), (0, 0, 2), (0, 1, -2))]
    scene = scene_of([*walls, *balls, quad(spot(far, -1, -1, 0), (2, 0, 0), (0, 2, 0))])
    round_y = [about((0, 1, 0), a) for a in (0, 120, 240, 360)]
    tilt = [about((0.6, 0, 0.8), a) for a in (0, 90, 30)]
    scene = moving(scene, 3, slide=[(0, 0, 0), (-4, 1, 0.5), (0.25, 0, 0)])
    scene = moving(scene, 4, turns=round_y, pivot=spot(far))
    scene = moving(scene, 5, turns=tilt, pivot=spot(far, 0, 1, -2))
    return moving(scene, 6, turns=round_y, slide=[(0, 0, 0), (0, 0.5, 0), (0, 0, 0)], pivot=spot(far))


def shift(origins: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """What the way into an object's space may move a hit by: 16 roundings of the ray's reach there
    (glsl/rays/traverse.glsl), and 2 of the object's place. No object's middle is 2 m from its corners.
    """
    reach = np.linalg.norm(corners - origins[:, None], axis=2).max(axis=1) + 2.0
    return 16 * ULP * reach + 2 * ULP * np.abs(corners).max(axis=(1, 2))


def assert_same(
    corners: np.ndarray, origins: np.ndarray, directions: np.ndarray, got: Result, other: np.ndarray
) -> None:
    """Each hit is really there; none that the other tracer saw (-1: nothing) closer by more than rounding was lost."""
    hit = np.flatnonzero(got.hit)
    o, d, c = origins[hit], directions[hit], corners[got.triangle[hit]]
    t, inside = exact(o, d, c)
    t_error, weight_error = rounding(o, d, c, shift(o, c))
    with np.errstate(invalid="ignore"):
        assert not np.any(inside < -weight_error)
        assert not np.any(np.abs(t - got.t[hit]) > t_error)
    rays = np.flatnonzero(other >= 0)
    o, d, c = origins[rays], directions[rays], corners[other[rays]]
    t, inside = exact(o, d, c)
    t_error, weight_error = rounding(o, d, c, shift(o, c))
    found = np.where(got.hit, got.t, np.inf)[rays]
    with np.errstate(invalid="ignore"):
        lost = (found > t + 2 * t_error) & (inside > weight_error)
        assert np.mean(inside > weight_error) > 0.95, "the tolerances leave nothing to test"
    assert not lost.any(), f"{lost.sum()} of {len(origins)} rays"


@pytest.mark.parametrize("far", [0.0, 1000.0])
def test_two_levels_against_embree_on_the_flattened_scene(ctx: moderngl.Context, far: float) -> None:
    mesh_construction = pytest.importorskip("embreex.mesh_construction")
    from embreex.rtcore_scene import EmbreeScene

    rng = np.random.default_rng(1)
    mesh = MovingMesh(ctx, fair(rng, far))
    middle = np.array(spot(far))
    for time_s in TIMES:
        corners = mesh.corners(time_s)
        origins, directions = as_float32(middle + rng.uniform(-4, 4, (200_000, 3)), unit_vectors(rng, 200_000))
        result = mesh.trace(time_s, origins, directions)
        scene = EmbreeScene(robust=True)
        mesh_construction.TriangleMesh(scene, corners.astype(np.float32))
        embree = scene.run(origins.astype(np.float32), directions.astype(np.float32), output=True)
        assert 0.3 < result.hit.mean() < 1.0
        if not far:  # Embree's own corners are rounded to 2^-14 m at a distance of 1 km: no second opinion there
            assert_same(corners, origins, directions, result, embree["primID"])
        assert np.mean(result.hit == (embree["primID"] >= 0)) > 0.9995
        any_hit = mesh.trace(time_s, origins[::5], directions[::5], "trace_any(ray, t_max)")
        np.testing.assert_array_equal(any_hit.hit, result.hit[::5])
    mesh.release()


def test_two_levels_against_float64(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(2)
    mesh = MovingMesh(ctx, fair(rng))
    for time_s in TIMES[:3]:
        corners = mesh.corners(time_s)
        origins, directions = as_float32(rng.uniform(-4, 4, (3000, 3)), unit_vectors(rng, 3000))
        truth = brute_force(origins, directions, corners)
        got = mesh.trace(time_s, origins, directions)
        assert_same(corners, origins, directions, got, truth.triangle)
    mesh.release()


def _moving_triangles(mesh: MovingMesh) -> np.ndarray:
    return np.flatnonzero(mesh.triangles.objects[mesh.triangles.indices[:, 0]])


@pytest.mark.parametrize("far", [0.0, 1000.0])
@pytest.mark.parametrize("alone", [True, False])
def test_nothing_escapes_a_closed_object_however_it_is_turned(ctx: moderngl.Context, far: float, alone: bool) -> None:
    """Rays from inside aimed at edges and vertices where they are in the world; with and without things around."""
    rng = np.random.default_rng(3)
    middle = spot(far)
    meshes = [ball(rng, middle, 4)] + [ball(rng, spot(far, 9))] * (not alone)
    tilts = [about((0.48, 0.6, 0.64), a) for a in (0, 100, 200, 300)]
    scene = moving(scene_of(meshes), 0, turns=tilts, slide=[(0, 0, 0), (1, 2, 3)], pivot=middle)
    mesh = MovingMesh(ctx, scene)
    for time_s in TIMES[:4]:
        corners = mesh.corners(time_s)[_moving_triangles(mesh)]
        centre = corners.mean(axis=(0, 1))
        triangle = corners[rng.integers(0, len(corners), 60_000)]
        along = np.where(rng.random(len(triangle)) < 0.3, 0.0, rng.random(len(triangle)))[:, None]
        targets = triangle[:, 0] * (1 - along) + triangle[:, 1] * along
        origins = centre + (triangle[:, 2] - centre) * rng.uniform(0, 0.5, (len(triangle), 1))
        origins, directions = as_float32(origins, targets - origins)
        for call in ("trace_closest(ray, t_max, hit)", "trace_any(ray, t_max)"):
            result = mesh.trace(time_s, origins, directions, call)
            assert result.hit.all(), f"{np.sum(~result.hit)} rays escaped at {time_s} s"
    mesh.release()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_flat_object_at_right_angles_is_hit_up_to_its_rim(ctx: moderngl.Context, axis: int) -> None:
    """A box without thickness, entered along and across its plane: turned by 0 and 90 degrees, and slid."""
    edges = [((0, 2, 0), (0, 0, 2)), ((2, 0, 0), (0, 0, 2)), ((2, 0, 0), (0, 2, 0))][axis]
    flat = quad(tuple(-np.add(*edges) / 2), *edges)
    normal = np.eye(3)[axis]
    spin = [about(tuple(np.roll(normal, 1)), a) for a in (0, 90, 180)]
    mesh = MovingMesh(ctx, moving(scene_of([flat]), 0, turns=spin, slide=[(0, 0, 0), (3, 2, 1)]))
    grid = np.linspace(-1 + 1e-6, 1 - 1e-6, 41)
    a, b = np.meshgrid(grid, grid)
    points = a.reshape(-1, 1) * np.divide(edges[0], 2) + b.reshape(-1, 1) * np.divide(edges[1], 2)
    for time_s in (0.0, 1.0, 2.0, 4.0 - 1e-9):
        (place,) = places(mesh.triangles.moving, time_s)
        there, facing = points @ place[:3, :3].T + place[:3, 3], place[:3, :3] @ normal
        origins, directions = as_float32(there + 5 * facing, np.tile(-facing, (len(there), 1)))
        result = mesh.trace(time_s, origins, directions)
        assert result.hit.all()
        np.testing.assert_allclose(result.t, 5, atol=64 * ULP * 8)
    mesh.release()


def test_a_scene_in_which_nothing_stands_still(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(4)
    mesh = MovingMesh(ctx, moving(scene_of([ball(rng, (0, 0, 0))]), 0, slide=[(0, 0, 0), (1, 0, 0)]))
    origins, directions = as_float32(rng.uniform(-3, 3, (2000, 3)), unit_vectors(rng, 2000))
    corners = mesh.corners(1.5)
    truth = brute_force(origins, directions, corners)
    assert_same(corners, origins, directions, mesh.trace(1.5, origins, directions), truth.triangle)
    mesh.release()
