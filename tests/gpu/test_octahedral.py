"""Unit vectors through the octahedral map, on both sides of the bus."""

from __future__ import annotations

import itertools

import numpy as np

from app.gpu.octahedral import octahedral_decode, octahedral_encode, pack_normals, pack_tangents

from .harness import call_glsl

FILE = "lib/octahedral.glsl"


def directions() -> np.ndarray:
    """Random unit vectors, and every axis, edge and corner of the octahedron, where its folds lie."""
    corners = np.array([v for v in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(v)])
    tilted = corners + 1e-6 * np.array([1.0, -2.0, 3.0])
    vectors = np.concatenate([corners, tilted, np.random.default_rng(1).normal(size=(4000, 3))])
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_encoding_matches_its_twin(ctx) -> None:
    # Compared as directions: on a fold, -0 and +0 choose different, equally right, points of the square.
    encoded = call_glsl(ctx, FILE, "vec2 octahedral_encode(vec3 n)", directions())
    np.testing.assert_allclose(octahedral_decode(encoded), directions(), atol=4e-7)


def test_decoding_matches_its_twin(ctx) -> None:
    square = octahedral_encode(directions()).astype(np.float32)
    np.testing.assert_allclose(
        call_glsl(ctx, FILE, "vec3 octahedral_decode(vec2 p)", square), octahedral_decode(square), atol=4e-7
    )


def test_float64_round_trip_is_exact_to_rounding() -> None:
    np.testing.assert_allclose(octahedral_decode(octahedral_encode(directions())), directions(), atol=1e-15)


def test_packed_normals_are_found_again_within_half_a_step(ctx) -> None:
    # Half a snorm16 step in each of two numbers, stretched at most 3 times, in the middle of a face.
    found = call_glsl(ctx, FILE, "vec3 unpack_normal(uint bits)", pack_normals(directions()))
    assert np.linalg.norm(found - directions(), axis=1).max() < 3 * np.hypot(0.5, 0.5) / 32767


def test_packed_tangents_keep_their_handedness(ctx) -> None:
    n = directions()
    handed = np.where(np.arange(len(n)) % 2, 1.0, -1.0)
    found = call_glsl(ctx, FILE, "vec4 unpack_tangent(uint bits)", pack_tangents(np.column_stack([n, handed])))
    np.testing.assert_array_equal(found[:, 3], handed)
    # The bit that handedness takes leaves steps of two in the second number.
    assert np.linalg.norm(found[:, :3] - n, axis=1).max() < 3 * np.hypot(0.5, 1.0) / 32767


def test_a_zero_vector_becomes_a_unit_vector(ctx) -> None:
    found = call_glsl(ctx, FILE, "vec3 unpack_normal(uint bits)", pack_normals(np.zeros((1, 3))))
    np.testing.assert_allclose(found, [[0, 0, 1]])
