"""glsl/lib/intersect.glsl against its float64 twins in app/bvh/oracle.py."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
import pytest

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
vec4 enter(vec3 o, vec3 d, vec3 origin, vec3 steps, uvec3 low, uvec3 high, float t_max) {
    RaySetup s = prepare_ray(Ray(o, d, 0.0), origin, origin + 255.0 * steps);
    return intersect_boxes(s, origin, steps, low, high, 0.0, t_max);
}"""
ENTER_SIGNATURE = "vec4 enter(vec3 o, vec3 d, vec3 origin, vec3 steps, uvec3 low, uvec3 high, float t_max)"
GRIDS = [  # (origin, steps, planes of the grid that boxes may use, the rays' origins in multiples of those)
    pytest.param((-3.0, -3.0, -3.0), (1.0, 1.0, 1.0), 7, 1.3, id="whole numbers"),
    pytest.param((0.375, -1.5, 2.0), (2.0**-9, 2.0**-7, 2.0**-8), 256, 1.2, id="a small node"),
    pytest.param((1e6, -3e5, 4096.0), (0.0625, 2.0, 2.0**-12), 256, 1.2, id="far from the origin"),
    pytest.param((2.0**30, 0.0, 0.0), (64.0, 2.0**10, 2.0**-30), 256, 1.2, id="uneven"),
    pytest.param((1e5, 0.0, -1e5), (2.0**-7, 2.0**-100, 2.0**-7), 256, 1.2, id="flat, 100 km away"),
    pytest.param((0.0, -(2.0**-60), 0.0), (2.0**-70, 2.0**-66, 2.0**-90), 256, 1.2, id="far below any length"),
    pytest.param((-(2.0**39), 0.0, 2.0**30), (2.0**32, 2.0**30, 2.0**31), 256, 1.2, id="as large as may be"),
]


@dataclass(frozen=True)
class Case:
    """Boxes on a grid, four a ray and half of them flat along some axis, and rays from about its planes."""

    grid: tuple[np.ndarray, np.ndarray]  # origin and steps, (3,)
    words: np.ndarray  # (2, COUNT, 3) low and high, four bytes each
    low: np.ndarray  # (COUNT, 4, 3) float64
    high: np.ndarray
    origins: np.ndarray  # (COUNT, 3)
    directions: np.ndarray

    @property
    def reach(self) -> np.ndarray:
        """(COUNT, 1, 1) from the ray's origin to the corners of the grid, along the longest axis."""
        first, step = self.grid
        return np.abs(np.stack([first, first + 255 * step])[:, None] - self.origins).max(axis=(0, 2))[:, None, None]

    def enter(self, ctx: moderngl.Context, t_max: float) -> np.ndarray:
        """(COUNT, 4) as the shader says."""
        args = self.origins, self.directions, *self.grid, *self.words, t_max
        return call_glsl(ctx, INCLUDE, ENTER_SIGNATURE, *args, extra=ENTER).astype(float)

    def truth(self, t_max: float, widening: np.ndarray | float = 0.0) -> np.ndarray:
        rays = self.origins[:, None], self.directions[:, None]
        return oracle.intersect_boxes(*rays, self.low - widening, self.high + widening, 0.0, t_max)


def boxes_and_rays(seed: int, origin: tuple[float, ...], steps: tuple[float, ...], planes: int, around: float) -> Case:
    rng = np.random.default_rng(seed)
    first, step = float32(np.array(origin)), np.array(steps)
    ends = rng.integers(0, planes, (2, COUNT, 4, 3))
    ends[1] = np.where(rng.random((COUNT, 4, 3)) < 0.2, ends[0], ends[1])
    ends.sort(axis=0)
    words = np.ascontiguousarray(np.swapaxes(ends, 2, 3).astype(np.uint8)).view(np.uint32)[..., 0]
    place = rng.uniform(-around, around, (COUNT, 3)) * planes / 2 + planes / 2
    place = np.where(rng.random((COUNT, 3)) < 0.5, np.round(place), place)
    directions = rng.normal(size=(COUNT, 3)) * step / step.max()
    directions[rng.random((COUNT, 3)) < 0.3] = 0.0
    directions *= rng.choice([-1.0, 1.0], (COUNT, 3))  # -0.0 too
    directions[np.abs(directions).max(axis=1) < 1e-6, step.argmax()] = 1.0  # the least length that a ray may have
    low, high = first + ends * step
    return Case((first, step), words, low, high, float32(first + place * step), float32(directions))


@pytest.mark.parametrize(("origin", "steps", "planes", "around"), GRIDS)
def test_boxes_are_never_missed_and_entered_no_later(
    ctx: moderngl.Context, origin: tuple[float, ...], steps: tuple[float, ...], planes: int, around: float
) -> None:
    """Nor is a box that the triangle test's errors, up to 10 roundings of the reach, bring within reach of the ray."""
    case = boxes_and_rays(3, origin, steps, planes, around)
    t_max = 0.8 * planes * max(steps)
    ours, truth = case.enter(ctx, t_max), case.truth(t_max)
    assert np.isfinite(ours[np.isfinite(case.truth(t_max, 10 * ULP * case.reach))]).all()
    assert (ours <= truth * (1 + 3 * ULP)).all()
    assert 0.01 < np.isfinite(truth).mean() < 0.6  # both answers occur


@pytest.mark.parametrize(("origin", "steps", "planes", "around"), GRIDS)
def test_boxes_are_widened_by_no_more_than_the_margin(
    ctx: moderngl.Context, origin: tuple[float, ...], steps: tuple[float, ...], planes: int, around: float
) -> None:
    """Every box reported hit is hit in float64 once widened by a few roundings of the coordinates."""
    case = boxes_and_rays(4, origin, steps, planes, around)
    t_max = 0.8 * planes * max(steps)
    ours = case.enter(ctx, t_max)
    far = np.abs(case.origins).max(axis=1)[:, None, None]
    truth = case.truth(t_max * (1 + 10 * ULP), 2 * (15 * ULP * case.reach + ULP * far) + 8 * ULP * case.reach)
    assert np.isfinite(truth[np.isfinite(ours)]).all()
    assert np.isfinite(ours).any()
    assert not np.isfinite(ours).all()


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
