"""The stack that a walk is given holds whatever the walk may have to remember, in trees made to need the most."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.bvh import cache
from app.bvh.build import MAX_DEPTH, Bvh, build_bvh
from app.bvh.pack import NO_CHILD, empty_nodes, is_inner, leaf_reference, stack_entries, tree_depth
from app.bvh.top import MAX_TOP_DEPTH, top_depth, top_level

ONE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def shrinking(count: int, ratio: float, along: float = 0.0) -> np.ndarray:
    """Triangles each `ratio` times the one before, nested, or set `along` a line."""
    size = ratio ** np.arange(count, dtype=float)[:, None, None]
    return size * (np.add(ONE, [along, along, 0]))


PATHOLOGICAL = {
    "nested halves": shrinking(100, 0.5),
    "nested thirds": shrinking(60, 1 / 3),
    "nested, slowly": shrinking(5000, 0.5 ** (1 / 60)),
    "line of doubling gaps": shrinking(100, 0.5, along=3.0),
    "line of gaps times 33": shrinking(24, 1 / 33, along=3.0),  # just what 32 bins put into one
    "identical": np.repeat(ONE[None], 5000, axis=0),
    "identical centroids": (ONE - ONE.mean(axis=0)) * np.linspace(1e-3, 1e3, 3000)[:, None, None],
    "sorted line": ONE + np.arange(4000)[:, None, None] * [1, 0, 0],
    "sorted by size and place": (ONE + 1) * np.arange(1, 3000)[:, None, None] ** 3.0,
    "one point": np.zeros((2000, 3, 3)),
    "three chains": np.concatenate([shrinking(100, 0.5, 3.0) * s for s in ([1, 1, 1], [-1, 1, 1], [1, -1, 1])]),
}


def built(corners: np.ndarray) -> Bvh:
    corners = corners.astype(np.float32)
    return build_bvh(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3))


def most_waiting(nodes: np.ndarray, node: int = 0) -> int:
    """Entries of the stack, the end's mark included, on the worst walk: every child hit, the deepest one first."""
    worst, pending = 0, [(node, 1)]
    while pending:
        this, waiting = pending.pop()
        children = nodes["child"][this]
        there = int((children != NO_CHILD).sum())
        worst = max(worst, waiting + max(there - 1, 0))
        pending += [(int(c), waiting + there - 1) for c in children[is_inner(children)]]
    return worst


@pytest.mark.parametrize("name", PATHOLOGICAL)
def test_no_walk_outgrows_its_stack(name: str) -> None:
    bvh = built(PATHOLOGICAL[name])
    assert bvh.depth == tree_depth(bvh.nodes) <= MAX_DEPTH
    assert most_waiting(bvh.nodes) <= stack_entries(bvh.depth) <= stack_entries(MAX_DEPTH)


def test_some_tree_needs_all_of_it() -> None:
    """A chain of full nodes: the bound is no guess with room to spare."""
    nodes = empty_nodes(5)
    nodes["child"] = leaf_reference(np.arange(20), np.ones(20, int)).reshape(5, 4)
    nodes["child"][:-1, 2] = np.arange(1, 5)
    assert tree_depth(nodes) == 5
    assert most_waiting(nodes) == stack_entries(5)


@pytest.mark.parametrize("count", [1, 2, 3, 40, 256])
def test_nor_does_one_of_the_top_level(count: int) -> None:
    size = (1.7 ** np.arange(count))[:, None] * np.ones(3)
    low, high = (0 * size).astype(np.float32), np.minimum(size, 1e12).astype(np.float32)
    nodes = top_level(low, high, np.arange(count, dtype=np.uint32), max(count - 1, 1))
    assert most_waiting(nodes) <= stack_entries(top_depth(count)) <= stack_entries(MAX_TOP_DEPTH)


def test_a_tree_deeper_than_the_stack_is_refused() -> None:
    with pytest.raises(ValueError, match="49 nodes deep; at most 48"):
        stack_entries(MAX_DEPTH + 1)


def chain(length: int) -> np.ndarray:
    nodes = empty_nodes(length)
    nodes["child"][:-1, 0] = np.arange(1, length)
    return nodes


def with_child(nodes: np.ndarray, node: int, reference: int) -> np.ndarray:
    nodes["child"][node, 3] = reference
    return nodes


@pytest.mark.parametrize(
    "nodes",
    [
        pytest.param(with_child(chain(4), 3, 0), id="a cycle"),
        pytest.param(with_child(chain(4), 0, 3), id="a node reached twice"),
        pytest.param(with_child(chain(4), 0, 4), id="a node that is not there"),
        pytest.param(with_child(chain(4), 2, 2), id="a node in itself"),
    ],
)
def test_what_is_no_tree_is_refused(nodes: np.ndarray) -> None:
    """A walk through it would leave its arrays or never end, and a GPU that hangs takes the desktop with it."""
    with pytest.raises(ValueError, match="no tree"):
        tree_depth(nodes)


@pytest.mark.parametrize("tamper", ["depth", "cycle", "leaf"])
def test_a_cached_tree_that_would_break_a_walk_is_built_again(
    tamper: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole files that hold something else: told from damage by no checksum."""
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path))
    corners = np.random.default_rng(0).random((900, 3), np.float32)
    indices = np.arange(900, dtype=np.uint32).reshape(-1, 3)
    good, _ = cache.load_or_build(corners, indices)
    (file,) = cache.cache_dir().iterdir()
    with np.load(file) as data:
        arrays = dict(data)
    nodes = arrays["nodes"].view(good.nodes.dtype)[:, 0]
    if tamper == "depth":
        arrays["depth"] = np.array(1)
    elif tamper == "cycle":
        nodes["child"][-1, 0] = 0
    else:
        nodes["child"][-1, 0] = leaf_reference(np.array([299]), np.array([4]))[0]
    np.savez(file, **arrays)
    again, notes = cache.load_or_build(corners, indices)
    assert len(notes) == 1
    assert again.nodes.tobytes() == good.nodes.tobytes()
    assert again.depth == good.depth
