"""The top level: a valid tree over any boxes, small and soon built; joined trees keep every node and triangle."""

from __future__ import annotations

from time import thread_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.bvh.build import build_bvh
from app.bvh.pack import NO_CHILD, WIDTH, child_boxes, is_leaf, leaf_range
from app.bvh.top import MAX_TOP_DEPTH, joined, top_depth, top_level, world_boxes


def walk(nodes: np.ndarray, root: int = 0) -> tuple[dict[int, list[tuple[np.ndarray, np.ndarray]]], int]:
    """(leaf's object -> boxes on the way to it, most inner nodes on a path)."""
    low, high = child_boxes(nodes)
    leaves: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    deepest, pending = 0, [(root, 1, [])]
    while pending:
        node, depth, above = pending.pop()
        deepest = max(deepest, depth)
        for child in range(WIDTH):
            reference = nodes["child"][node, child]
            path = [*above, (low[node, child], high[node, child])]
            if is_leaf(reference):
                leaves[int(leaf_range(reference)[0])] = path
            elif reference != NO_CHILD:
                pending.append((int(reference), depth + 1, path))
    return leaves, deepest


@st.composite
def boxes(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """Scattered, nested, coincident, flat, and in geometric progression."""
    count, kind = draw(st.integers(1, 40)), draw(st.sampled_from(["any", "same", "powers", "flat"]))
    rng = np.random.default_rng(draw(st.integers(0, 999)))
    centre, half = rng.uniform(-9, 9, (count, 3)), rng.uniform(0, 3, (count, 3))
    if kind == "same":
        centre[:], half[:] = centre[0], half[0]
    if kind == "powers":
        centre = half = 2.0 ** np.arange(count)[:, None] * np.ones(3)
    if kind == "flat":
        half[:] = 0
    return (centre - half).astype(np.float32), (centre + half).astype(np.float32)


@settings(max_examples=100, deadline=None)
@given(boxes=boxes())
def test_every_object_is_a_leaf_inside_all_boxes_above_it(boxes: tuple[np.ndarray, np.ndarray]) -> None:
    low, high = boxes
    names = np.arange(len(low), dtype=np.uint32)[::-1] + 3
    leaves, depth = walk(top_level(low, high, names, max(len(low) - 1, 1)))
    assert sorted(leaves) == sorted(names.tolist())
    assert depth <= top_depth(len(low)) <= MAX_TOP_DEPTH
    for i, name in enumerate(names.tolist()):
        for box_low, box_high in leaves[name]:
            assert (box_low <= low[i]).all()
            assert (high[i] <= box_high).all()


def test_nothing_in_the_tree_is_an_empty_node() -> None:
    nothing = np.zeros((0, 3), np.float32)
    nodes = top_level(nothing, nothing, np.zeros(0, np.uint32), 2)
    assert (nodes["child"] == NO_CHILD).all()


def test_the_most_objects_stay_within_the_stack() -> None:
    """Sizes in geometric progression, which an unguarded heuristic would peel off one by one."""
    size = 1.1 ** np.arange(256.0)[:, None] * np.ones(3)
    leaves, depth = walk(top_level((0 * size).astype("f4"), size.astype("f4"), np.arange(256, dtype=np.uint32), 255))
    assert len(leaves) == 256
    assert depth <= MAX_TOP_DEPTH


def test_a_handful_is_built_well_below_a_millisecond() -> None:
    rng = np.random.default_rng(1)
    low = rng.uniform(-5, 5, (4, 3)).astype(np.float32)
    names = np.arange(4, dtype=np.uint32)
    times = []
    for _ in range(30):
        begin = thread_time()
        top_level(low, low + 1, names, 3)
        times.append(thread_time() - begin)
    assert min(times) < 1e-3


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 999), far=st.sampled_from([0.0, 1e3, 1e6]))
def test_world_boxes_hold_what_float32_matrices_place(seed: int, far: float) -> None:
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = q, rng.uniform(-far - 1, far + 1, 3)
    half = rng.uniform(0, 2, 3)
    low, high = world_boxes(place[None], half[None])
    corners = half * rng.choice([-1.0, 1.0], (8, 3))
    rounded = place.astype(np.float32).astype(float)
    for matrix in (place, rounded):
        world = corners @ matrix[:3, :3].T + matrix[:3, 3]
        assert (world >= low[0]).all()
        assert (world <= high[0]).all()


@pytest.mark.parametrize("counts", [(5,), (3, 9), (0, 4, 1), (30, 1, 2, 17)])
def test_joined_trees_hold_the_same_leaves(counts: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    trees = []
    for count in counts:
        corners = rng.normal(size=(3 * count, 3)).astype(np.float32)
        trees.append(build_bvh(corners, np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)))
    whole = joined(trees)
    room = max(len(counts) - 1, 1)
    assert whole.roots[0] == room
    assert (whole.nodes["child"][:room] == NO_CHILD).all()
    first = 0
    for tree, root in zip(trees, whole.roots, strict=True):
        part = whole.nodes[root : root + len(tree.nodes)]
        for name in ("origin", "low", "high"):
            np.testing.assert_array_equal(part[name], tree.nodes[name])
        assert set(walk(whole.nodes, root)[0]) == {k + first for k in walk(tree.nodes)[0]}
        np.testing.assert_array_equal(whole.order[first : first + len(tree.order)], tree.order + first)
        first += len(tree.order)
    assert whole.depth == max(tree.depth for tree in trees)
