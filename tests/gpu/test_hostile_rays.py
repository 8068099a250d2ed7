"""Rays made to break a slab test or a triangle test: along axes, planes and edges, from surfaces and flat boxes, with
components of every size; and two identities that need no tolerance.
"""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
import trimesh

from app.bvh.oracle import brute_force

from .harness import call_glsl
from .rays import ULP, Mesh, rounding
from .test_traverse import as_float32, assert_none_invented, assert_none_lost, moved, nasty_corners, nasty_rays

COUNT = 20_000
EDGE_VALUES = np.array([0.0, -0.0, 1e-45, -1e-45, 1e-38, -1e-30, 1e-18, -1e-7, 0.5, 1.0, -1.0, 1e6])
PLACES = np.array([0.0, -0.0, 1e-45, 1e-30, -1e-7, 0.25, -0.5, 1.0, -1.0, 2.0, -3.0])


def planes() -> np.ndarray:
    """A box, and sheets without thickness in three planes, each cut into eight triangles."""
    square = np.array([[[-1, -1, 0], [0, -1, 0], [0, 0, 0]], [[-1, -1, 0], [0, 0, 0], [-1, 0, 0]]], float)
    flat = np.concatenate([moved(square, x, y, 0) for x in (0, 1) for y in (0, 1)])
    box = trimesh.creation.box(extents=[2, 2, 2]).triangles
    return np.concatenate(
        [flat, np.roll(flat, 1, axis=2) - [0.25, 0, 0], np.roll(flat, 2, axis=2), moved(box, 2, 0, 0)]
    )


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6])
def test_inverse_directions_are_finite_numbers(ctx: moderngl.Context, length: float) -> None:
    """So is a coordinate of 10^12 m over a component: no infinity meets a zero and makes NaN, of which GLSL lets
    `min` and `max` make anything.
    """
    directions = np.array(np.meshgrid(*[EDGE_VALUES] * 3)).reshape(3, -1).T
    directions = directions[np.abs(directions).max(axis=1) >= 0.5]
    directions *= length / np.abs(directions).max(axis=1, keepdims=True)
    inverse = "vec3 inverse_of(vec3 d) { return prepare_ray(Ray(vec3(0.0), d, 0.0), vec3(-1.0), vec3(1.0)).inverse; }"
    ours = call_glsl(ctx, "lib/intersect.glsl", "vec3 inverse_of(vec3 d)", directions, extra=inverse).astype(float)
    assert np.isfinite(ours).all()
    assert (np.abs(ours) * 1e12 < 3e38).all()
    rounded = np.asarray(directions, np.float32).astype(float)
    large = np.abs(rounded) > 1e-17 * length
    np.testing.assert_allclose(ours[large], 1 / rounded[large], rtol=2 * ULP)
    assert (np.sign(ours[large]) == np.sign(rounded[large])).all()


def test_edge_values_in_every_component(ctx: moderngl.Context) -> None:
    """Zeros of both signs, denormal numbers, and components 10^6 and 10^-45 side by side."""
    rng = np.random.default_rng(21)
    mesh = Mesh.of(ctx, planes())
    directions = EDGE_VALUES[rng.integers(0, len(EDGE_VALUES), (COUNT, 3))]
    small = np.abs(directions).max(axis=1) < 0.1
    directions[small, rng.integers(0, 3, small.sum())] = rng.choice([-1.0, 1.0], small.sum())
    origins, directions = as_float32(PLACES[rng.integers(0, len(PLACES), (COUNT, 3))], directions)
    result = mesh.trace(origins, directions)
    assert 0.3 < result.hit.mean() < 1.0
    assert np.isfinite(result.t[result.hit]).all()
    truth = brute_force(origins, directions, mesh.corners)
    assert_none_invented(mesh, origins, directions, result)
    assert_none_lost(mesh, origins, directions, result, truth.t, truth.triangle)
    mesh.release()


def test_the_sign_of_a_zero_changes_nothing(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(22)
    mesh = Mesh.of(ctx, planes())
    directions = rng.choice([0.0, 1.0, -1.0, 0.5, 1e-7], (COUNT, 3))
    directions[~directions.any(axis=1), 2] = 1.0
    origins = PLACES[rng.integers(0, len(PLACES), (COUNT, 3))]
    a, b = (mesh.trace(origins, np.where(directions == 0, zero, directions)) for zero in (0.0, -0.0))
    np.testing.assert_array_equal(a.hit, b.hit)
    np.testing.assert_array_equal(a.triangle, b.triangle)
    np.testing.assert_array_equal(a.t[a.hit], b.t[a.hit])
    mesh.release()


@pytest.mark.parametrize(("scale", "at"), [(1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 1e3)])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_surfaces_are_met_where_rays_begin_on_them(ctx: moderngl.Context, axis: int, scale: float, at: float) -> None:
    """From either side and at any slant: boxes of no thickness hold their surface. The distance is 0 at right angles,
    else within what float32 may be off, which grows with the scene and no constant; beyond that nothing is met.
    """
    rng = np.random.default_rng(23)
    sheet = np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    corners = np.concatenate([moved(sheet, *place) for place in ((0, 0, 0), (5, 5, 5), (-3, 30, 7))])
    corners = np.roll(corners, axis, axis=2) * scale + at
    origins = np.column_stack([rng.uniform(-0.9, 0.9, (COUNT, 2)), np.zeros(COUNT)])
    directions = rng.normal(size=(COUNT, 3))
    directions[: COUNT // 2] = [0.0, -0.0, 1.0]
    directions *= rng.choice([-scale, scale], (COUNT, 1)) / np.linalg.norm(directions, axis=1, keepdims=True)
    origins, directions, corners = as_float32(
        np.roll(origins, axis, axis=1) * scale + at, np.roll(directions, axis, axis=1), corners
    )
    mesh = Mesh.of(ctx, corners)
    result = mesh.trace(origins, directions, t_min=-0.5)
    assert result.hit.all()
    error, _ = rounding(origins, directions, mesh.corners[result.triangle])
    assert (np.abs(result.t) <= error).all()
    assert np.median(error) < 1e-5 * (1.0 + at)
    np.testing.assert_array_equal(result.t[: COUNT // 2], 0.0)
    steep = error < 0.01
    beyond = mesh.trace(origins[steep], directions[steep], t_min=0.01, t_max=0.5)
    assert not beyond.hit.any()
    mesh.release()


def test_rays_in_the_planes_and_along_the_edges_of_triangles(ctx: moderngl.Context) -> None:
    """In its own plane a triangle is nothing to hit; along an edge, only what else lies there. No NaN gets out."""
    rng = np.random.default_rng(24)
    corners = np.concatenate([planes(), nasty_corners(rng)]).astype(np.float32).astype(float)
    mesh = Mesh.of(ctx, corners)
    count = COUNT // 4
    triangle = corners[rng.integers(0, len(corners), count)]
    weights = rng.uniform(-1, 2, (2, count, 3))  # in the plane, inside and outside
    weights[:, : count // 2, 2] = 0.0  # on the line of an edge
    weights[..., 0] = 1.0 - weights[..., 1] - weights[..., 2]
    start, end = np.einsum("sri,rij->srj", weights, triangle)
    kept = np.abs(end - start).max(axis=1) > 1e-3
    origins, directions = as_float32(start[kept], (end - start)[kept])
    result = mesh.trace(origins, directions)
    assert np.isfinite(result.t[result.hit]).all()
    assert np.isfinite(result.barycentrics[result.hit]).all()
    truth = brute_force(origins, directions, corners)
    assert_none_invented(mesh, origins, directions, result)
    assert_none_lost(mesh, origins, directions, result, truth.t, truth.triangle)
    mesh.release()


@pytest.mark.parametrize("exponent", [-30, -10, 13, 30])
def test_scaling_by_a_power_of_two_changes_no_bit(ctx: moderngl.Context, exponent: int) -> None:
    """No constant of the tests has a unit: a thousandth or ten thousandfold, the same hits at scaled distances."""
    rng = np.random.default_rng(25)
    scale = 2.0**exponent
    corners = nasty_corners(rng)
    origins, directions = nasty_rays(rng, corners, COUNT)
    mesh, scaled = Mesh.of(ctx, corners), Mesh.of(ctx, corners * scale)
    a, b = mesh.trace(origins, directions), scaled.trace(origins * scale, directions)
    np.testing.assert_array_equal(a.hit, b.hit)
    np.testing.assert_array_equal(a.triangle, b.triangle)
    np.testing.assert_array_equal(a.t[a.hit] * scale, b.t[a.hit])
    mesh.release()
    scaled.release()


@pytest.mark.parametrize("exponent", [-20, -3, 5, 20])
def test_distances_count_in_lengths_of_the_direction(ctx: moderngl.Context, exponent: int) -> None:
    rng = np.random.default_rng(26)
    scale = 2.0**exponent
    mesh = Mesh.of(ctx, nasty_corners(rng))
    origins, directions = nasty_rays(rng, mesh.corners, COUNT)
    a, b = mesh.trace(origins, directions), mesh.trace(origins, directions * scale)
    np.testing.assert_array_equal(a.hit, b.hit)
    np.testing.assert_array_equal(a.triangle, b.triangle)
    np.testing.assert_array_equal(a.t[a.hit], b.t[a.hit] * scale)
    mesh.release()
