"""glsl/lib/intersect.glsl against its float64 twins in app/bvh/oracle.py."""

from __future__ import annotations

import moderngl
import numpy as np

from app.bvh import oracle

from .harness import call_glsl
from .rays import ULP, exact, rounding

INCLUDE = "lib/intersect.glsl"
COUNT = 200_000


def float32(a: np.ndarray) -> np.ndarray:
    return np.asarray(a, np.float32).astype(float)


def close_products(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of nearly parallel vectors: most of their edge functions cancel to the last bit, or beyond it."""
    a = float32(rng.uniform(-1, 1, (COUNT, 2)))
    factor = rng.choice([1.0, -1.0, 0.5, 3.0, 1 / 3, 0.7], (COUNT, 1))
    b = float32(a * factor * (1 + rng.choice([0, 1, -1], (COUNT, 2)) * 2 * ULP))
    return a, b


def test_edge_function_has_the_exact_sign(ctx: moderngl.Context) -> None:
    a, b = close_products(np.random.default_rng(0))
    truth = oracle.edge_function(a, b)
    ours = call_glsl(ctx, INCLUDE, "float edge_function(vec2 a, vec2 b)", a, b)
    rounded_to_zero = np.float32(a[:, 0]) * np.float32(b[:, 1]) == np.float32(a[:, 1]) * np.float32(b[:, 0])
    assert (rounded_to_zero & (truth != 0)).sum() > COUNT // 20  # the hard case occurs
    np.testing.assert_array_equal(np.sign(ours), np.sign(truth))
    size = np.abs(a[:, 0] * b[:, 1]) + np.abs(a[:, 1] * b[:, 0])
    assert (np.abs(ours - truth) <= 2 * ULP * size).all()


def test_edge_function_is_exactly_opposite_from_the_other_side(ctx: moderngl.Context) -> None:
    a, b = close_products(np.random.default_rng(1))
    signature = "float edge_function(vec2 a, vec2 b)"
    np.testing.assert_array_equal(call_glsl(ctx, INCLUDE, signature, a, b), -call_glsl(ctx, INCLUDE, signature, b, a))


def test_product_error_is_exact(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(2)
    a, b = (float32(rng.uniform(-1, 1, COUNT) * 10.0 ** rng.integers(-6, 7, COUNT)) for _ in range(2))
    product = float32(a * b)
    ours = call_glsl(ctx, INCLUDE, "float product_error(float a, float b, float ab)", a, b, product)
    np.testing.assert_array_equal(ours, a * b - product)


ENTER = """
vec2 enter(vec3 o, vec3 d, vec3 lo0, vec3 hi0, vec3 lo1, vec3 hi1, float t_max) {
    RaySetup s = prepare_ray(Ray(o, d, 0.0), min(lo0, lo1), max(hi0, hi1));
    return intersect_boxes(s, vec4(lo0.x, hi0.x, lo1.x, hi1.x), vec4(lo0.y, hi0.y, lo1.y, hi1.y),
                           vec4(lo0.z, hi0.z, lo1.z, hi1.z), 0.0, t_max);
}"""
ENTER_SIGNATURE = "vec2 enter(vec3 o, vec3 d, vec3 lo0, vec3 hi0, vec3 lo1, vec3 hi1, float t_max)"


def boxes_and_rays(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Boxes on a coarse grid, half of them flat along some axis; rays from grid points, many with zero components."""
    corner = rng.integers(-3, 4, (2, COUNT, 3)).astype(float)
    lo, hi = corner.min(axis=0), corner.max(axis=0)
    origins = np.where(rng.random((COUNT, 3)) < 0.5, rng.integers(-4, 5, (COUNT, 3)), rng.uniform(-4, 4, (COUNT, 3)))
    directions = rng.normal(size=(COUNT, 3))
    directions[rng.random((COUNT, 3)) < 0.3] = 0.0
    directions *= rng.choice([-1.0, 1.0], (COUNT, 3))  # -0.0 too
    directions[(directions == 0).all(axis=1), 0] = 1.0
    return lo, hi, float32(origins), float32(directions)


def test_boxes_are_never_missed_and_entered_no_later(ctx: moderngl.Context) -> None:
    lo, hi, origins, directions = boxes_and_rays(np.random.default_rng(3))
    t_max = 3.0
    ours = call_glsl(ctx, INCLUDE, ENTER_SIGNATURE, origins, directions, lo, hi, lo, hi, t_max, extra=ENTER)
    np.testing.assert_array_equal(ours[:, 0], ours[:, 1])
    truth = oracle.intersect_boxes(origins, directions, lo, hi, 0.0, t_max)
    assert np.isfinite(ours[np.isfinite(truth), 0]).all()
    assert (ours[:, 0] <= truth * (1 + 3 * ULP)).all()


def test_boxes_are_widened_by_no_more_than_the_margin(ctx: moderngl.Context) -> None:
    """Every box reported hit is hit in float64 once widened by a few roundings of the coordinates."""
    lo, hi, origins, directions = boxes_and_rays(np.random.default_rng(4))
    ours = call_glsl(ctx, INCLUDE, ENTER_SIGNATURE, origins, directions, lo, hi, lo, hi, 3.0, extra=ENTER)
    reach = np.maximum(np.abs(lo - origins), np.abs(hi - origins)).max(axis=1, keepdims=True)
    widening = 2 * (10 * ULP * reach + ULP * np.abs(origins).max(axis=1, keepdims=True)) + 8 * ULP * reach
    truth = oracle.intersect_boxes(origins, directions, lo - widening, hi + widening, 0.0, 3.0 * (1 + 10 * ULP))
    assert np.isfinite(truth[np.isfinite(ours[:, 0])]).all()
    assert 0.05 < np.isfinite(ours[:, 0]).mean() < 0.5  # both answers occur


HIT = """
vec4 hit(vec3 o, vec3 d, vec3 a, vec3 b, vec3 c) {
    RaySetup s = prepare_ray(Ray(o, d, 0.0), min(a, min(b, c)), max(a, max(b, c)));
    float t;
    vec2 weights;
    bool found = intersect_triangle(s, o, a, b, c, 0.0, 1e30, t, weights);
    return vec4(found ? 1.0 : 0.0, t, weights);
}"""


def test_triangles_against_float64(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(5)
    corners = float32(rng.uniform(-3, 3, (COUNT, 1, 3)) + rng.normal(size=(COUNT, 3, 3)))
    origins = float32(rng.uniform(-4, 4, (COUNT, 3)))
    aim = np.einsum("ri,rij->rj", rng.dirichlet([0.5] * 3, COUNT) * 1.2 - 0.2 / 3, corners)  # some beside the triangle
    directions = float32((aim - origins) * rng.uniform(0.1, 10, (COUNT, 1)))
    ours = call_glsl(
        ctx,
        INCLUDE,
        "vec4 hit(vec3 o, vec3 d, vec3 a, vec3 b, vec3 c)",
        origins,
        directions,
        *corners.swapaxes(0, 1),
        extra=HIT,
    ).astype(float)
    t, inside = exact(origins, directions, corners)
    t_error, weight_error = rounding(origins, directions, corners)
    found = ours[:, 0] == 1
    assert found[inside > weight_error].all()
    assert not found[inside < -weight_error].any()
    assert (np.abs(ours[found, 1] - t[found]) <= t_error[found]).all()
    _, v, w = oracle.intersect_triangle(origins, directions, corners)
    weights = np.stack([v, w], axis=1)
    assert (np.abs(ours[found, 2:] - weights[found]) <= weight_error[found, None] + 4 * ULP).all()
    assert 0.2 < found.mean() < 0.8  # both answers occur


def test_degenerate_triangles_and_edge_on_rays_are_missed(ctx: moderngl.Context) -> None:
    origin, direction = np.zeros((4, 3)), np.array([[0, 0, 1.0]] * 4)
    a = np.array([[0, 0, 1.0], [-1, 0, 1], [0, 0, 1], [0, -1, 0]])
    b = np.array([[0, 0, 1.0], [1, 0, 1], [0, 0, 1], [0, 1, 0]])
    c = np.array([[0, 0, 1.0], [0, 0, 1], [1, 1, 1], [0, 0, 5]])  # point, collinear, two equal corners, seen edge-on
    ours = call_glsl(
        ctx, INCLUDE, "vec4 hit(vec3 o, vec3 d, vec3 a, vec3 b, vec3 c)", origin, direction, a, b, c, extra=HIT
    )
    assert (ours[:, 0] == 0).all()
