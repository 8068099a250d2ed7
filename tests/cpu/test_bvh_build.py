"""The tree's invariants, on meshes made to break builders."""

from __future__ import annotations

import numpy as np
import pytest

from app.bvh import build
from app.bvh.build import Bvh, build_bvh
from app.bvh.pack import (
    BVH_NODE,
    MAX_LEAF,
    MAX_TRIANGLES,
    NO_CHILD,
    child_boxes,
    from_lowest_corner,
    is_inner,
    is_leaf,
    leaf_range,
    leaf_reference,
    pack_triangle_positions,
    pack_triangles,
    turns,
)


def soup(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (m, 3, 3) as positions and indices."""
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3)


def random_soup(count: int, size: float = 0.05, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.random((count, 1, 3)) + size * rng.standard_normal((count, 3, 3))


ONE = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], float)
MESHES = {
    "none": np.zeros((0, 3, 3)),
    "one": ONE,
    "two": np.stack([ONE[0], ONE[0] + (0, 0, 1)]),
    "two equal": np.repeat(ONE, 2, axis=0),
    "five": random_soup(5),
    "duplicates": np.repeat(ONE, 1000, axis=0),
    "concentric": (ONE - ONE.mean(axis=1, keepdims=True)) * np.arange(1, 301)[:, None, None],
    "points": np.repeat(np.random.default_rng(1).random((200, 1, 3)), 3, axis=1),
    "one point": np.full((100, 3, 3), 0.3),
    "flat": random_soup(500) * [1, 0, 1],
    "line": random_soup(500) * [0, 0, 1],
    "slivers": random_soup(500) * [1, 1e-6, 1] + np.random.default_rng(2).random((500, 1, 3)) * [0, 1, 0],
    "far away": random_soup(500) + 1e6,
    "huge": random_soup(500) * 1e11,
    "tiny": random_soup(500) * 1e-36,
    "geometric": ONE * (0.5 ** (np.arange(600) / 6))[:, None, None],
    "soup": random_soup(20_000),
}


def check(bvh: Bvh, positions: np.ndarray, indices: np.ndarray) -> None:
    """Every triangle in one leaf, every node reached once, every box around all that is below, the depth as told."""
    assert bvh.nodes.dtype == BVH_NODE
    np.testing.assert_array_equal(np.sort(bvh.order), np.arange(len(indices)))
    corners = positions[indices[bvh.order]]
    reached = np.zeros(len(bvh.nodes), int)
    covered = np.zeros(len(indices), int)
    levels, current = [], np.array([0])
    while current.size:
        np.add.at(reached, current, 1)
        levels.append(current)
        reference = bvh.nodes["child"][current].ravel()
        for first, count in zip(*leaf_range(reference[is_leaf(reference)]), strict=True):
            assert 1 <= count <= build.LEAF_SIZE
            covered[first : first + count] += 1
        current = reference[is_inner(reference)].astype(int)
    assert (reached == 1).all()
    assert (covered == 1).all()
    assert len(levels) == bvh.depth <= build.MAX_DEPTH
    check_boxes(bvh.nodes, corners, levels)


def check_boxes(nodes: np.ndarray, corners: np.ndarray, levels: list[np.ndarray]) -> None:
    """Decoded boxes hold the triangles `corners` (m, 3, 3) below them, and less than a step of the grid more."""
    low, high = (box.astype(float) for box in child_boxes(nodes))
    step = np.stack([nodes[name] for name in ("step_x", "step_y", "step_z")], axis=1).astype(float)
    below = np.full((2, len(nodes), 3), [[[np.inf]], [[-np.inf]]])  # lowest and highest corner below each node
    for level in reversed(levels):
        for node in level:
            for child, reference in enumerate(nodes["child"][node]):
                if reference == NO_CHILD:
                    continue
                if is_leaf(reference):
                    first, count = leaf_range(reference)
                    points = corners[first : first + count].reshape(-1, 3).astype(float)
                    lowest, highest = points.min(axis=0), points.max(axis=0)
                else:
                    lowest, highest = below[:, reference]
                assert (low[node, child] <= lowest).all()
                assert (lowest - low[node, child] < step[node]).all()
                assert (high[node, child] >= highest).all()
                assert (high[node, child] - highest < step[node]).all()
                below[0, node] = np.minimum(below[0, node], lowest)
                below[1, node] = np.maximum(below[1, node], highest)


@pytest.mark.parametrize("name", MESHES)
def test_invariants(name: str) -> None:
    positions, indices = soup(MESHES[name])
    with np.errstate(all="raise", under="ignore"):
        bvh = build_bvh(positions, indices)
    check(bvh, positions, indices)
    assert np.isfinite(bvh.stats.sah_cost)
    assert bvh.stats.inner_nodes == len(bvh.nodes)


def test_small_trees_have_the_documented_form() -> None:
    none, one, two = (build_bvh(*soup(MESHES[name])).nodes["child"] for name in ("none", "one", "two"))
    assert len(none) == len(one) == len(two) == 1
    assert (none == NO_CHILD).all()
    np.testing.assert_array_equal(is_leaf(one[0]), [True, False, False, False])
    np.testing.assert_array_equal(is_leaf(two[0]), [True, True, False, False])
    assert (one[0, 1:] == NO_CHILD).all()
    assert (two[0, 2:] == NO_CHILD).all()


def test_same_input_same_tree() -> None:
    mesh = soup(random_soup(3000))
    first, second = build_bvh(*mesh), build_bvh(*mesh)
    assert first.nodes.tobytes() == second.nodes.tobytes()
    assert first.order.tobytes() == second.order.tobytes()


@pytest.mark.parametrize("bound", [11, 12, 14])
def test_depth_bound_holds_for_chains(bound: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "MAX_DEPTH", bound)
    positions, indices = soup(np.repeat(ONE, 5000, axis=0) * (0.5 ** (np.arange(5000) / 60))[:, None, None])
    bvh = build_bvh(positions, indices)  # 5000 / 4 needs at least 11 halvings
    check(bvh, positions, indices)


def test_sah_beats_halving() -> None:
    """The cost of a tree cut by SAH is well below one whose every node is halved in input order."""
    positions, indices = soup(random_soup(4000, size=0.01))
    sah = build_bvh(positions, indices).stats.sah_cost
    halved = len(indices)  # any random order makes nearly all boxes as large as the root's
    assert sah < 0.1 * halved


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e13])
def test_unusable_coordinates_are_refused(bad: float) -> None:
    positions, indices = soup(random_soup(10))
    positions[7, 1] = bad
    with pytest.raises(ValueError, match="coordinate"):
        build_bvh(positions, indices)


def test_unused_vertices_do_not_matter() -> None:
    positions, indices = soup(random_soup(10))
    check(build_bvh(np.vstack([positions, [[np.nan] * 3]]).astype(np.float32), indices), positions, indices)


def test_progress_rises_to_one() -> None:
    seen: list[float] = []
    build_bvh(*soup(random_soup(3000)), lambda text, fraction: seen.append(fraction))
    assert seen == sorted(seen)
    assert seen[0] > 0
    assert seen[-1] == 1.0


def test_leaf_references_round_trip() -> None:
    first, count = np.array([0, 5, (1 << 28) - 8]), np.array([1, 4, MAX_LEAF])
    reference = leaf_reference(first, count)
    assert is_leaf(reference).all()
    np.testing.assert_array_equal(leaf_range(reference), (first, count))
    assert not is_leaf(np.array([NO_CHILD, 0, 12345], np.uint32)).any()


def test_packed_triangles_follow_the_leaf_order() -> None:
    positions, indices = soup(random_soup(50))
    materials = np.arange(len(positions), dtype=np.uint32) // 3
    order = build_bvh(positions, indices).order
    triangles = pack_triangles(order, indices, materials)
    np.testing.assert_array_equal(triangles[:, :3], indices[order])
    np.testing.assert_array_equal(triangles[:, 3], order)
    drawn = np.random.default_rng(0).permutation(len(order))
    corners = pack_triangle_positions(order, positions, indices, drawn)
    np.testing.assert_array_equal(corners[..., :3], positions[indices[order]])
    np.testing.assert_array_equal(np.argsort(corners[:, 0, 3]), np.argsort(drawn[order]))


def test_turns_are_normal_numbers_that_sort_as_their_places() -> None:
    """Up to the last triangle that a leaf reference can name; float32 itself would take 2^24 and 2^24 + 1 for equal."""
    drawn = np.concatenate([np.arange(1000), 2**24 + np.arange(-3, 4), MAX_TRIANGLES - np.arange(3, 0, -1)])
    turn = turns(drawn)
    assert (np.diff(turn) > 0).all()
    assert turn[0] == 2.0
    assert np.isfinite(turn).all()


def test_copies_of_a_triangle_begin_alike() -> None:
    """However each was begun; wound as it was. Equal coordinates are told apart by the next axis."""
    rng = np.random.default_rng(1)
    positions, indices = soup(np.round(random_soup(500, size=2.0)))
    distinct = [len(set(map(tuple, positions[triangle].tolist()))) == 3 for triangle in indices]
    indices = indices[distinct]
    begun = np.take_along_axis(indices, (rng.integers(0, 3, (len(indices), 1)) + np.arange(3)) % 3, axis=1)
    same = from_lowest_corner(positions, begun)
    corners = positions[same]
    np.testing.assert_array_equal(corners, positions[from_lowest_corner(positions, indices)])
    for triangle, original in zip(corners.tolist(), indices, strict=True):
        assert triangle[0] == min(triangle)
        assert triangle in [positions[np.roll(original, k)].tolist() for k in range(3)]
