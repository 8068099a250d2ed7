"""Two levels: one tree for what stands still, one for each moving object, and a small tree over them for each frame.

The top level takes the first nodes of the same array, since shaders may count on eight storage blocks only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import used_vertices
from ..scene.model import F64, Triangles
from .build import Bvh, BvhStats, Progress
from .pack import WIDTH, empty_nodes, is_inner, is_leaf, leaf_reference, pack_nodes
from .split import F32, Index, half_area
from .wide import Children, widened

MAX_TOP_DEPTH = 12  # binary nodes on a path: 255 objects and the rest need 8; the others let clusters stay together
# Rounding of a box's corners, relative to the largest coordinate: float64 matrices rounded to float32 (2^-24 each),
# three terms summed, and the box itself rounded.
BOX_ROUNDING = 8 * 2.0**-24

Build = Callable[[NDArray[np.float32], NDArray[np.uint32], Progress | None], Bvh]


def scene_tree(triangles: Triangles, build: Build, progress: Progress | None = None) -> Bvh:
    """The tree of a scene: `build`'s own where nothing moves, else one for each object behind room for the top level.

    `roots[k]` is where the tree of object k begins; 0 is what stands still.
    """
    if not triangles.moving:
        return build(triangles.positions, triangles.indices, progress)
    owner = triangles.objects[triangles.indices[:, 0]]
    first = np.searchsorted(owner, np.arange(len(triangles.moving) + 2))
    trees = []
    for begin, end in pairwise(first):
        used, own = used_vertices(triangles.indices[begin:end], len(triangles.positions))
        trees.append(build(triangles.positions[used], own, progress))
    return joined(trees)


def joined(trees: Sequence[Bvh]) -> Bvh:
    """Several trees as one array of nodes; in front, room for the top level of as many leaves."""
    room = max(len(trees) - 1, 1)
    nodes, order, roots, first = [empty_nodes(room)], [], [], 0
    for tree in trees:
        roots.append(sum(map(len, nodes)))
        moved = tree.nodes.copy()
        moved["child"] = _shifted(moved["child"], roots[-1], first)
        nodes.append(moved)
        order.append(tree.order + np.uint32(first))
        first += len(tree.order)
    stats = BvhStats(
        sum(t.stats.inner_nodes for t in trees),
        sum(t.stats.leaves for t in trees),
        sum(t.stats.sah_cost for t in trees),
        sum(t.stats.seconds for t in trees),
    )
    depth = max(t.depth for t in trees)
    return Bvh(np.concatenate(nodes), np.concatenate(order), depth, stats, tuple(roots))


def world_boxes(to_world: F64, half_sizes: F64) -> tuple[F32, F32]:
    """(lowest, highest) corners (k, 3) [m, world] of boxes around objects' origins, placed by matrices (k, 4, 4)."""
    centre = to_world[:, :3, 3]
    reach = np.einsum("kij,kj->ki", np.abs(to_world[:, :3, :3]), half_sizes)
    reach += BOX_ROUNDING * (np.abs(centre) + reach)
    return (centre - reach).astype(np.float32), (centre + reach).astype(np.float32)


def top_depth(leaves: int) -> int:
    """Most nodes on a path of a top level. A node that has another below it holds the work of three binary ones."""
    return min(max(-(-(leaves - 1) // (WIDTH - 1)), 1), MAX_TOP_DEPTH)


def top_level(low: F32, high: F32, objects: NDArray[np.uint32], room: int) -> NDArray[Any]:
    """(room,) nodes of a tree over boxes (k, 3) [m]; its leaves name `objects` (k,) instead of triangles.

    Method: surface area heuristic over all cuts of the sorted boxes, in three axes at once (Wald 2007, section 2).
    """
    nodes = empty_nodes(room)
    box = np.concatenate([low.T, -high.T]).astype(np.float32)  # (6, k) as in split.py
    leaf = leaf_reference(objects, np.ones(len(objects), np.int64))
    binary = Children.missing(max(len(objects) - 1, 1), 2)
    if len(objects) == 1:
        binary.put(np.array([0]), leaf, box)
    used, pending = 0, [(-1, np.arange(len(objects)), MAX_TOP_DEPTH)] if len(objects) > 1 else []
    while pending:
        slot, members, levels = pending.pop()
        if len(members) == 1:
            reference = leaf[members[0]]
        else:
            reference, used = np.uint32(used), used + 1
            left, right = _cheapest_cut(box[:, members], 1 << (levels - 1))
            pending += [
                (2 * int(reference), members[left], levels - 1),
                (2 * int(reference) + 1, members[right], levels - 1),
            ]
        if slot >= 0:
            binary.put(np.array([slot]), reference, box[:, members].min(axis=1, keepdims=True))
    wide, _ = widened(binary)
    nodes[: len(wide.reference)] = pack_nodes(wide.reference, wide.box)
    return nodes


def _cheapest_cut(box: F32, largest: int) -> tuple[Index, Index]:
    """Both sides of the cheapest cut between boxes (6, m) in the order of their centres; at most `largest` a side."""
    count = box.shape[1]
    if count == 2:
        return np.array([0]), np.array([1])
    order = np.argsort(box[:3] - box[3:], axis=1, kind="stable")  # (3, m)
    rows = box[:, order]  # (6, 3 axes, m)
    left = half_area(np.minimum.accumulate(rows, axis=2)[..., :-1])
    right = half_area(np.minimum.accumulate(rows[..., ::-1], axis=2)[..., -2::-1])
    ahead = np.arange(1, count)
    cost = left * ahead + right * (count - ahead)
    cost[:, np.maximum(ahead, count - ahead) > largest] = np.inf
    axis, cut = divmod(int(np.argmin(cost)), count - 1)
    return order[axis, : cut + 1], order[axis, cut + 1 :]


def _shifted(reference: NDArray[np.uint32], node: int, triangle: int) -> NDArray[np.uint32]:
    """Child references of a tree whose nodes and triangles begin at these places of larger arrays."""
    leaf, inner = is_leaf(reference), is_inner(reference)
    return reference + np.where(leaf, np.uint32(triangle), np.where(inner, np.uint32(node), np.uint32(0)))
