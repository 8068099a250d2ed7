"""Bounding volume hierarchy by binned SAH, built level by level in numpy with two children a node, then widened.

Degenerate input, by name, and what becomes of it:
  no triangle          one node without children: every ray misses
  one triangle         one node with a single leaf
  coincident centroids (duplicates, concentric triangles) no plane separates them: the run is cut in the middle
  zero-extent nodes    (flat boxes, points) area 0 makes all planes equally cheap: the first separating one is taken,
                       and with no separating plane the run is cut in the middle
  slivers              only their boxes matter here; large overlapping boxes just cost time
  endless chains       (sizes in geometric progression) a node that an unlucky plane could push beyond MAX_DEPTH is cut
                       in the middle; that takes 28 - log2(LEAF_SIZE) levels at most, far fewer than MAX_DEPTH, and
                       so always fits: the depth is bounded for every input
  NaN, infinity, coordinates beyond 1e12 m: refused with ValueError, the scene loader's validation comes first
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import log2
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from .pack import MAX_TRIANGLES, STACK_DEPTH, is_inner, is_leaf, leaf_range, leaf_reference, pack_nodes
from .split import F32, Index, Segments, best_splits, half_area
from .wide import Children, widened

BUILDER_VERSION = 2  # part of the cache key: raise it whenever the same input gives another tree
LEAF_SIZE = 4  # most triangles in a leaf
NODE_COST = 2.0  # time of testing one node's boxes, in triangle tests: between 0.5 and 2 llvmpipe hardly cares
MAX_DEPTH = STACK_DEPTH  # most binary nodes on a path; the four-wide ones that are made of them are fewer
COORDINATE_LIMIT = 1e12  # m: an area times a triangle count stays finite in float32

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class BvhStats:
    """What the build cost and how good the tree is."""

    inner_nodes: int
    leaves: int
    sah_cost: float  # expected work of a ray that hits the root box, in triangle tests
    seconds: float


@dataclass(frozen=True)
class Bvh:
    """The packed tree. `order[i]` is the scene's triangle at place i of the leaf order."""

    nodes: NDArray[np.void]  # (k,) BVH_NODE, k >= 1, root first
    order: NDArray[np.uint32]  # (m,)
    depth: int  # most nodes on a path from the root
    stats: BvhStats
    roots: tuple[int, ...] = (0,)  # several trees in one array: where each begins (app/bvh/top.py)


@dataclass(frozen=True)
class _Level:
    """The nodes of one depth that await a decision, and their triangles, node after node."""

    start: Index  # (k,) where the node's triangles begin in leaf order
    count: Index  # (k,)
    slot: Index  # (k,) 2 * parent + child: where the parent wants the reference and the box
    triangle: NDArray[np.uint32]  # (n,)
    box: F32  # (6, n) as in split.py


@dataclass(frozen=True)
class _Children:
    """What one level's nodes are to their parents."""

    slot: Index
    reference: NDArray[np.uint32]
    box: F32  # (6, k)


def build_bvh(positions: F32, indices: NDArray[np.uint32], progress: Progress | None = None) -> Bvh:
    """Builds the tree of triangles `indices` (m, 3) over `positions` (n, 3) m.

    Raises ValueError if a coordinate used is not finite or beyond COORDINATE_LIMIT, or if there are too many triangles.
    """
    begin = perf_counter()
    box = _triangle_boxes(positions, indices)
    total = box.shape[1]
    order = np.empty(total, np.uint32)
    zero = np.zeros(1, np.intp)
    level = _Level(zero, zero + total, zero, np.arange(total, dtype=np.uint32), box)
    settled: list[_Children] = []
    binary_depth, inner_nodes = 0, 0
    while level.triangle.size:
        children, level = _grow(level, binary_depth, inner_nodes, order)
        settled.append(children)
        inner_nodes += level.count.size // 2
        binary_depth += 1
        if progress is not None:
            progress("Building the ray hierarchy", _fraction_done(total, level.count))
    wide, depth, leaves, cost = _assemble(settled, inner_nodes)
    nodes = pack_nodes(wide.reference, wide.box)
    return Bvh(nodes, order, depth, BvhStats(len(nodes), leaves, cost, perf_counter() - begin))


def _triangle_boxes(positions: F32, indices: NDArray[np.uint32]) -> F32:
    """Boxes of all triangles, (6, m) as in split.py."""
    if len(indices) >= MAX_TRIANGLES:
        raise ValueError(f"{len(indices)} triangles exceed the {MAX_TRIANGLES} that a leaf reference can name")
    box = np.empty((6, len(indices)), np.float32)
    for axis in range(3):
        a, b, c = np.ascontiguousarray(positions[:, axis], np.float32)[indices.T]
        box[axis] = np.minimum(np.minimum(a, b), c)
        box[3 + axis] = -np.maximum(np.maximum(a, b), c)
    if not np.all(np.abs(box) <= COORDINATE_LIMIT):  # NaN fails the comparison as well
        raise ValueError(f"a vertex coordinate is NaN, infinite or beyond {COORDINATE_LIMIT:g} m")
    return box


def _grow(level: _Level, depth: int, first_id: int, order: NDArray[np.uint32]) -> tuple[_Children, _Level]:
    """Makes each node of a level a leaf, written to `order`, or an inner node with two children in the next level."""
    segments = Segments.of(level.count)
    bounds = segments.minimum(level.box)
    split = best_splits(segments, level.box, level.box[:3] - level.box[3:])  # twice the centroid sorts as well
    halve = np.isinf(split.cost) | (depth + 1 + _halvings(level.count - 1) > MAX_DEPTH)
    leaf = _is_leaf(level.count, half_area(bounds), split.cost, halve, depth)
    rank = segments.rank()
    done = leaf[segments.owner]
    order[(level.start[segments.owner] + rank)[done]] = level.triangle[done]

    right = np.where(halve[segments.owner], 2 * rank >= level.count[segments.owner], split.right)
    reference = np.empty(leaf.size, np.uint32)
    reference[leaf] = leaf_reference(level.start[leaf], level.count[leaf])
    inner = np.arange(first_id, first_id + np.count_nonzero(~leaf))
    reference[~leaf] = inner
    below = _partition(level, segments, right, ~leaf, inner)
    return _Children(level.slot, reference, bounds), below


def _halvings(count: Index) -> Index:
    """How many times a run must be halved to fit into leaves."""
    return np.ceil(np.log2(np.maximum(count / LEAF_SIZE, 1))).astype(np.intp)


def _is_leaf(count: Index, area: F32, split_cost: F32, halve: NDArray[np.bool_], depth: int) -> NDArray[np.bool_]:
    """Small nodes that are cheaper whole than cut. A root of two or more triangles is cut, to have two children."""
    cheaper_whole = halve | (split_cost + np.float32(NODE_COST) * area >= area * count)
    small = (count <= LEAF_SIZE) & cheaper_whole & (depth > 0)
    leaf: NDArray[np.bool_] = (count == 1) | small
    return leaf


def _partition(
    level: _Level, segments: Segments, right: NDArray[np.bool_], kept: NDArray[np.bool_], inner: Index
) -> _Level:
    """The next level: both sides of each kept node, in stable order; `inner` are the kept nodes' ids."""
    members = np.flatnonzero(kept[segments.owner])
    part = Segments.of(segments.count[kept])
    right = right[members]
    rights = np.concatenate([[0], np.cumsum(right)])  # rights[i]: how many before member i go right
    right_count = rights[part.first + part.count] - rights[part.first]
    left_count = part.count - right_count
    rank_right = rights[:-1] - rights[part.first][part.owner]
    rank = np.where(right, left_count[part.owner] + rank_right, part.rank() - rank_right)
    place = part.first[part.owner] + rank
    source = np.empty_like(members)
    source[place] = members
    start = level.start[kept]
    return _Level(
        start=np.column_stack([start, start + left_count]).ravel(),
        count=np.column_stack([left_count, right_count]).ravel(),
        slot=np.column_stack([2 * inner, 2 * inner + 1]).ravel(),
        triangle=level.triangle[source],
        box=level.box[:, source],
    )


def _fraction_done(total: int, open_counts: Index) -> float:
    """Share of the work done: a node of n triangles still costs about n log2(n)."""
    left = float(np.sum(open_counts * np.log2(open_counts + 1.0)))
    return 1.0 - left / (total * log2(total + 1.0))


def _assemble(settled: list[_Children], inner_nodes: int) -> tuple[Children, int, int, float]:
    """Nodes, depth, number of leaves and SAH cost. The root has no parent; a lone leaf becomes its only child."""
    binary = Children.missing(max(inner_nodes, 1), 2)
    for level in settled[1:] if inner_nodes else settled:
        binary.put(level.slot, level.reference, level.box)
    wide, depth = widened(binary)
    leaf = is_leaf(wide.reference)
    if not settled:
        return wide, depth, 0, 0.0
    work = np.where(leaf, leaf_range(wide.reference)[1], np.where(is_inner(wide.reference), NODE_COST, 0.0))
    weight = half_area(wide.box) / np.maximum(half_area(settled[0].box), np.finfo(np.float32).tiny)
    return wide, depth, int(leaf.sum()), NODE_COST + float(np.sum(work * weight, dtype=np.float64))
