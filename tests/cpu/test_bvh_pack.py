"""Nodes of four children: boxes only ever grow, on a grid that float32 decodes without rounding."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.bvh.build import COORDINATE_LIMIT
from app.bvh.pack import (
    BVH_NODE,
    LAST_PLANE,
    NO_CHILD,
    SMALLEST_STEP,
    WIDTH,
    child_boxes,
    empty_nodes,
    is_inner,
    is_leaf,
    leaf_reference,
    pack_nodes,
    stack_entries,
)
from app.bvh.split import half_area
from app.bvh.wide import Children, widened

STEPS = ("step_x", "step_y", "step_z")


@st.composite
def nodes_and_boxes(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(references, low, high) of children near and far from 0, from denormal to as large as scenes may be, some flat,
    some missing.
    """
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    count = 20
    far, size = (10.0 ** draw(st.integers(-45, 12)) for _ in range(2))
    centre = rng.uniform(-far, far, (count, 1, 3)) + rng.uniform(-size, size, (count, WIDTH, 3))
    half = size * rng.choice([0.0, 1e-9, 1e-3, 1.0], (count, WIDTH, 3)) * rng.random((count, WIDTH, 3))
    low, high = (np.clip(c, -COORDINATE_LIMIT, COORDINATE_LIMIT) for c in (centre - half, centre + half))
    reference = np.where(rng.random((count, WIDTH)) < 0.2, NO_CHILD, rng.integers(0, 99, (count, WIDTH)))
    return reference.astype(np.uint32), low.astype(np.float32), high.astype(np.float32)


def packed(reference: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    with np.errstate(all="raise", under="ignore"):
        return pack_nodes(reference, np.moveaxis(np.concatenate([low, -high], axis=2), 2, 0))


@settings(max_examples=300, deadline=None)
@given(given_boxes=nodes_and_boxes())
def test_decoded_boxes_hold_the_given_ones_exactly(given_boxes: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    reference, low, high = given_boxes
    nodes = packed(reference, low, high)
    assert nodes.dtype == BVH_NODE
    np.testing.assert_array_equal(nodes["child"], reference)
    there = reference != NO_CHILD
    step = np.stack([nodes[name] for name in STEPS], axis=1).astype(float)[:, None]
    decoded_low, decoded_high = (box.astype(float) for box in child_boxes(nodes))
    assert (decoded_low <= low)[there].all()
    assert (decoded_high >= high)[there].all()
    assert (low - decoded_low < step)[there].all()
    assert (decoded_high - high < step)[there].all()


@settings(max_examples=300, deadline=None)
@given(given_boxes=nodes_and_boxes())
def test_decoding_rounds_nothing(given_boxes: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    """Every plane of the used part of the grid is the same in float32 and in float64; steps are powers of two."""
    nodes = packed(*given_boxes)
    decoded = child_boxes(nodes)
    for box, name in zip(decoded, ("low", "high"), strict=True):
        assert box.dtype == np.float32
        for axis, step in enumerate(STEPS):
            count = nodes[name][:, axis, None] >> (8 * np.arange(WIDTH)) & LAST_PLANE
            exact = nodes["origin"][:, axis, None].astype(float) + count * nodes[step][:, None].astype(float)
            np.testing.assert_array_equal(box[:, :, axis], exact)
    for step in STEPS:
        fraction, exponent = np.frexp(nodes[step])
        assert (fraction == 0.5).all()
        assert (exponent > SMALLEST_STEP).all()


@pytest.mark.parametrize("place", [0.0, 1.0, -3.7e5, 1e12, 1e-20])
def test_a_grid_is_no_coarser_than_it_must_be(place: float) -> None:
    """Flat, it is as fine as float32 is there; else it has half as many steps as bytes can count, at least."""
    reference = np.zeros((1, WIDTH), np.uint32)
    corner = np.full((1, WIDTH, 3), place, np.float32)
    flat = packed(reference, corner, corner)
    np.testing.assert_array_equal(child_boxes(flat), [corner, corner])
    size = np.float32(max(abs(place), 1e-20))
    wide = packed(reference, corner, corner + size)
    assert (wide["step_x"] * LAST_PLANE < 2.1 * size).all()


def test_a_node_without_children_can_be_packed() -> None:
    none = packed(np.full((1, WIDTH), NO_CHILD, np.uint32), *np.zeros((2, 1, WIDTH, 3), np.float32))
    assert (none["child"] == NO_CHILD).all()
    assert (empty_nodes(3)["child"] == NO_CHILD).all()


def chain(length: int) -> Children:
    """A binary tree whose every node holds a leaf and, the last two leaves apart, the next node."""
    binary = Children.missing(length, 2)
    leaves = leaf_reference(np.arange(length + 1), np.ones(length + 1, int))
    size = np.arange(length, 0, -1, dtype=np.float32)
    box = np.tile(size, (6, 1)) * np.array([[0], [0], [0], [-1], [-1], [-1]], np.float32)
    binary.put(2 * np.arange(length), leaves[:-1], box)
    binary.put(2 * np.arange(length) + 1, np.append(np.arange(1, length, dtype=np.uint32), leaves[-1]), box)
    return binary


@pytest.mark.parametrize("length", range(1, 12))
def test_widening_a_chain_divides_its_depth_by_three(length: int) -> None:
    wide, depth = widened(chain(length))
    assert depth == len(wide.reference) == -(-length // 3)
    leaves = wide.reference[is_leaf(wide.reference)]
    np.testing.assert_array_equal(np.sort(leaves), leaf_reference(np.arange(length + 1), np.ones(length + 1, int)))
    full = is_inner(wide.reference).any(axis=1)
    assert (wide.reference[full] != NO_CHILD).all()  # only nodes above leaves alone have room left
    np.testing.assert_array_equal(wide.reference[is_inner(wide.reference)], np.arange(1, depth))


def test_the_largest_boxes_are_opened() -> None:
    """A root of boxes 1 and 2, each of two inner nodes: 2 is opened, then the larger of what it held."""
    binary = Children.missing(7, 2)
    leaf = leaf_reference(np.arange(8), np.ones(8, int))
    children = np.concatenate([np.array([1, 2, 3, 4, 5, 6], np.uint32), leaf])
    size = np.array([1, 2, 0.9, 0.8, 1.5, 0.7, *[0.1] * 8], np.float32)
    binary.put(np.arange(14), children, np.concatenate([np.zeros((3, 14)), -np.tile(size, (3, 1))]).astype(np.float32))
    wide, depth = widened(binary)
    assert depth == 2
    np.testing.assert_array_equal(np.sort(half_area(wide.box)[0]), np.sort(3 * size[[0, 5, 10, 11]] ** 2))


def test_the_stack_holds_the_worst_walk() -> None:
    """Every child of every node hit: three wait at each of `depth` levels, above the mark of the end."""
    assert stack_entries(1) == 1 + 3
    assert stack_entries(7) == 1 + 7 * 3
