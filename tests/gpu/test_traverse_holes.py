"""Alpha masks: a ray passes the holes that it meets, in order, and ends where nothing lets it through."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.bvh.oracle import brute_force

from .rays import Mesh
from .test_traverse import as_float32, assert_none_invented, assert_none_lost, unit_vectors


def test_masked_holes_let_rays_through(ctx: moderngl.Context) -> None:
    """A mask by material equals tracing the triangles that are left."""
    rng = np.random.default_rng(6)
    corners = (
        (rng.uniform(-1, 1, (400, 1, 3)) + rng.normal(scale=0.3, size=(400, 3, 3))).astype(np.float32).astype(float)
    )
    material = rng.integers(0, 4, 400).astype(np.uint32)
    mesh = Mesh.of(ctx, corners, material)
    passes = "(material & 1u) == 0u && v / 3u == uvec3(v.x / 3u)"  # in this mesh, three vertices are one triangle's
    alpha = f"bool alpha_passes(uint material, uvec3 v, vec2 weights, float t) {{ return {passes}; }}"
    origins, directions = as_float32(rng.uniform(-2, 2, (20_000, 3)), unit_vectors(rng, 20_000))
    result = mesh.trace(origins, directions, alpha=alpha)
    even = np.flatnonzero(material % 2 == 0)
    truth = brute_force(origins, directions, corners[even])
    assert not np.isin(result.triangle[result.hit], np.flatnonzero(material % 2)).any()
    other = np.where(truth.triangle >= 0, even[truth.triangle], -1)
    assert_none_invented(mesh, origins, directions, result)
    assert_none_lost(mesh, origins, directions, result, truth.t, other)
    any_hit = mesh.trace(origins, directions, alpha=alpha, call="trace_any(ray, t_max)")
    np.testing.assert_array_equal(any_hit.hit, result.hit)
    mesh.release()


def test_a_ray_passes_stacked_and_coincident_holes_in_order(ctx: moderngl.Context) -> None:
    """Sheets in layers of five equal ones: a ray ends at the first solid one, by distance and then as drawn."""
    sheet = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], float)
    depth = np.repeat(np.arange(1.0, 41.0), 5)
    rng = np.random.default_rng(8)
    shuffled = rng.permutation(len(depth))
    depth = depth[shuffled]
    solid = (depth > 20) & (rng.random(len(depth)) < 0.3)
    mesh = Mesh.of(ctx, sheet + depth[:, None, None] * [0, 0, 1], solid.astype(np.uint32))
    alpha = "bool alpha_passes(uint material, uvec3 v, vec2 weights, float t) { return material == 1u; }"
    origins = np.column_stack([rng.uniform(-0.2, 0.2, (500, 2)), np.zeros(500)])
    result = mesh.trace(origins, np.broadcast_to([0.0, 0, 1], (500, 3)), alpha=alpha)
    expected = min(np.flatnonzero(solid), key=lambda i: (depth[i], i))
    assert (result.triangle == expected).all()
    nothing = mesh.trace(origins, np.broadcast_to([0.0, 0, 1], (500, 3)), t_max=19.5, alpha=alpha)
    assert not nothing.hit.any()
    mesh.release()


COUNTED = """
uint asked = 0u;
bool alpha_passes(uint material, uvec3 v, vec2 weights, float t) { ++asked; return material == 1u; }
bool counted(Ray ray, float t_max, out Hit hit) {
    bool found = trace_closest(ray, t_max, hit);
    hit.barycentrics = vec2(asked);
    return found;
}"""


@pytest.mark.parametrize(
    ("gap", "layers"),
    [(0.05, 1), (0.05, 16), (0.05, 64), (0.05, 256), (1e-6, 64), (1e-6, 256), (0.0, 2), (0.0, 64)],
)
def test_a_ray_asks_once_for_each_layer_that_it_passes(ctx: moderngl.Context, layers: int, gap: float) -> None:
    """Cut-out sheets before a solid one, far apart, within a few roundings, and in one place: as many questions as
    layers, so that the cost is linear and the walk ends. None is passed over or asked twice.
    """
    rng = np.random.default_rng(9)
    sheet = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], float)
    place = rng.permutation(np.arange(layers + 1))
    solid = place == layers
    depth = 1.0 + gap * place
    if not gap:
        solid = np.arange(layers + 1) == layers  # of coincident sheets, the last one drawn
    mesh = Mesh.of(ctx, sheet + depth[:, None, None] * [0, 0, 1], solid.astype(np.uint32))
    count = 500
    directions = np.column_stack([rng.uniform(-0.01, 0.01, (count, 2)), np.ones(count)])
    origins, directions = as_float32(np.column_stack([rng.uniform(-0.2, 0.2, (count, 2)), np.zeros(count)]), directions)
    result = mesh.trace(origins, directions, call="counted(ray, t_max, hit)", alpha=COUNTED)
    assert result.hit.all()
    assert (result.triangle == np.flatnonzero(solid)[0]).all()
    np.testing.assert_array_equal(result.barycentrics[:, 0], layers + 1)
    mesh.release()
    holes = Mesh.of(ctx, mesh.corners[~solid])
    nothing = holes.trace(origins, directions, call="counted(ray, t_max, hit)", alpha=COUNTED)
    assert not nothing.hit.any()
    np.testing.assert_array_equal(nothing.barycentrics[:, 0], layers)
    holes.release()
