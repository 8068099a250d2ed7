"""The harness itself: arrays arrive and return unchanged in every type, and broken GLSL names its line."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.gpu.shaders import ShaderError

from .harness import call_glsl

rng = np.random.default_rng(14)
FILE = "lib/coc.glsl"


@pytest.mark.parametrize(
    ("kind", "dtype", "components"),
    [
        ("float", "<f4", 1), ("int", "<i4", 1), ("uint", "<u4", 1), ("vec2", "<f4", 2), ("vec3", "<f4", 3),
        ("vec4", "<f4", 4), ("ivec2", "<i4", 2), ("uvec2", "<u4", 2), ("uvec3", "<u4", 3), ("uvec4", "<u4", 4),
    ],
)  # fmt: skip
@pytest.mark.parametrize("count", [1, 64, 65, 1000])
def test_values_pass_through(ctx: moderngl.Context, kind: str, dtype: str, components: int, count: int) -> None:
    values = (rng.standard_normal((count, components)) * 1e6).astype(dtype)
    values = values if components > 1 else values[:, 0]
    found = call_glsl(ctx, FILE, f"{kind} same({kind} x)", values, extra=f"{kind} same({kind} x) {{ return x; }}")
    assert found.dtype == np.dtype(dtype)
    assert (found == values).all()


def test_booleans_pass_both_ways(ctx: moderngl.Context) -> None:
    flags = np.array([0, 1, 0, 1, 1])
    assert (call_glsl(ctx, FILE, "bool no(bool x)", flags, extra="bool no(bool x) { return !x; }") == 1 - flags).all()


def test_single_values_are_broadcast(ctx: moderngl.Context) -> None:
    extra = "vec2 scale(vec2 v, float s, vec2 o) { return v * s + o; }"
    v = np.arange(20, dtype=float).reshape(10, 2)
    found = call_glsl(ctx, FILE, "vec2 scale(vec2 v, float s, vec2 o)", v, 2.0, (1.0, -1.0), extra=extra)
    assert (found == v * 2.0 + (1.0, -1.0)).all()


def test_defines_reach_the_function(ctx: moderngl.Context) -> None:
    found = call_glsl(ctx, FILE, "int n(int x)", [0], defines={"N": 7}, extra="int n(int x) { return N; }")
    assert found.tolist() == [7]


def test_a_mistake_is_an_error_that_names_the_line(ctx: moderngl.Context) -> None:
    with pytest.raises(ShaderError, match="<harness>:2:"):
        call_glsl(ctx, FILE, "float f(float x)", [0.0], extra="float f(float x) { return y; }")
