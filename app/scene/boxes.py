"""A few hundred boxes around everything that can be seen: what a frame's facts test against the view.

Made once, when a scene is loaded, from triangles alone: facts are wanted long before any ray asks for its tree.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .model import F64, Material, Triangles

MOST_BOXES = 512  # a frame's facts then cost a tenth of a millisecond
# Boxes are put together from this many runs of triangles that follow each other in the file, as neighbours mostly do. A
# run whose box has more than this of the whole scene's surface is no neighbourhood: its triangles count one by one.
MOST_RUNS = 1 << 14
LARGEST_RUN = 1.0 / (2 * MOST_BOXES)

ALPHA_MASKED, NORMAL_MAPPED = 1, 2  # what surfaces in a box may be: bits of `Boxes.kinds`
ANYTHING = ALPHA_MASKED | NORMAL_MAPPED

Kinds = NDArray[np.uint8]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Boxes:
    """Axis-aligned boxes, m, world, that together hold every point of the scene at any time."""

    centre: F64  # (n, 3)
    half: F64  # (n, 3) half their sizes
    kinds: Kinds  # (n,) bits
    reach: float  # largest coordinate of any of their points in the space where the GPU keeps positions, m


def boxes_between(low: F64, high: F64, kinds: Kinds, origin: F64) -> Boxes:
    """Boxes from their corners (n, 3). `origin`: of the space in which the GPU keeps positions, m, world."""
    reach = np.maximum(np.abs(low - origin), np.abs(high - origin)).max(initial=0.0)
    return Boxes(0.5 * (low + high), 0.5 * (high - low), kinds, float(reach))


def single_box(low: ArrayLike, high: ArrayLike) -> Boxes:
    """One box that may hold anything, for a scene about the world's origin."""
    ends = np.asarray([low, high], np.float64)
    return boxes_between(ends[:1], ends[1:], np.full(1, ANYTHING, np.uint8), np.zeros(3))


def scene_boxes(triangles: Triangles, materials: Sequence[Material]) -> Boxes:
    """At most MOST_BOXES boxes: around triangles that stand still, and around all that moving objects pass through."""
    of_material = np.array([_kind(material) for material in materials], np.uint8)
    first = triangles.indices[:, 0]
    kinds, objects = of_material[triangles.materials[first]], triangles.objects[first]
    low, high, standing_kinds = _pieces(triangles, kinds, np.flatnonzero(objects == 0))
    moving_kinds = np.zeros(len(triangles.moving), np.uint8)
    np.bitwise_or.at(moving_kinds, objects[objects > 0] - 1, kinds[objects > 0])
    low = np.concatenate([low + triangles.origin, *(m.low[None] for m in triangles.moving)])
    high = np.concatenate([high + triangles.origin, *(m.high[None] for m in triangles.moving)])
    return _clustered(low, high, np.concatenate([standing_kinds, moving_kinds]), triangles.origin)


def _kind(material: Material) -> int:
    return ALPHA_MASKED * (material.alpha_cutoff is not None) + NORMAL_MAPPED * (material.normal_texture is not None)


def _pieces(triangles: Triangles, kinds: Kinds, chosen: Index) -> tuple[F64, F64, Kinds]:
    """Corners (k, 3) and kinds (k,) of boxes around runs of triangles or single ones, m, from the scene's origin."""
    chosen = chosen[np.argsort(kinds[chosen], kind="stable")]  # few runs of more than one kind
    kinds = kinds[chosen]
    a, b, c = (triangles.positions[triangles.indices[chosen, i]] for i in range(3))
    low, high = (pick(pick(a, b), c) for pick in (np.minimum, np.maximum))
    length = -(-len(chosen) // MOST_RUNS)
    if length <= 1:
        return low, high, kinds
    starts = np.arange(0, len(chosen), length)
    lows, highs = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
    bulky = _surface(lows, highs) > LARGEST_RUN * _surface(low.min(axis=0), high.max(axis=0))
    alone = np.repeat(bulky, length)[: len(chosen)]
    return (
        np.concatenate([lows[~bulky], low[alone]]),
        np.concatenate([highs[~bulky], high[alone]]),
        np.concatenate([np.bitwise_or.reduceat(kinds, starts)[~bulky], kinds[alone]]),
    )


def _clustered(low: F64, high: F64, kinds: Kinds, origin: F64) -> Boxes:
    """At most MOST_BOXES boxes around many, of one kind each: always the cluster with the largest surface is cut in
    two.
    """
    corners = np.ascontiguousarray(np.concatenate([low, high], axis=1).T)  # (6, n): rows are quick to search
    names = count()  # so that never two clusters are compared
    queue = [_entry(corners[:, kinds == kind], int(kind), next(names)) for kind in np.unique(kinds)]
    heapq.heapify(queue)
    while 0 < len(queue) < MOST_BOXES and queue[0].key < 0.0:
        cluster = heapq.heappop(queue)
        for part in _halves(cluster.corners):
            heapq.heappush(queue, _entry(part, cluster.kind, next(names)))
    lows, highs = (np.array([c.box[side] for c in queue]).reshape(-1, 3) for side in (0, 1))
    return boxes_between(lows, highs, np.array([c.kind for c in queue], np.uint8), origin)


class _Cluster(NamedTuple):
    """Boxes of one kind; the queue has the largest first."""

    key: float  # minus half the surface of a box around them, m^2; 0 for a single one
    name: int
    corners: F64  # (6, n) lowest, then highest
    kind: int
    box: tuple[F64, F64]


def _entry(corners: F64, kind: int, name: int) -> _Cluster:
    box = corners[:3].min(axis=1), corners[3:].max(axis=1)
    return _Cluster(-float(_surface(*box)) if corners.shape[1] > 1 else 0.0, name, corners, kind, box)


def _halves(corners: F64) -> list[F64]:
    """The boxes on either side of the middle of their centres, along the axis on which these lie farthest apart."""
    centres = corners[:3] + corners[3:]
    low, high = centres.min(axis=1), centres.max(axis=1)
    axis = int(np.argmax(high - low))
    left = centres[axis] < 0.5 * (low[axis] + high[axis])
    if not left.any():  # all in one place
        return [np.concatenate([corners[:3].min(axis=1), corners[3:].max(axis=1)])[:, None]]
    return [corners.take(np.flatnonzero(side), axis=1) for side in (left, ~left)]


def _surface(low: F64, high: F64) -> F64:
    """(...,) half the surface of boxes, m^2."""
    size = high - low
    x, y, z = size[..., 0], size[..., 1], size[..., 2]
    return np.asarray(x * y + y * z + z * x)
