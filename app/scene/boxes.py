"""A few hundred boxes around everything that can be seen: what the facts of a frame test against the view.

Made once, when a scene is loaded, from triangles alone: facts are wanted long before any ray asks for its tree.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .model import F64, Material, MovingObject, Triangles

MOST_BOXES = 512  # around what stands still: a frame's facts then cost a tenth of a millisecond
MOST_GROUPS = 1 << 13  # runs of neighbouring triangles that boxes are put together from
SIZE_CLASSES = 8  # triangles four times as large are no neighbours: a wall's box would hold the room
# A triangle whose box is at least this share of the scene deep along every axis stands askew: its box holds much that
# it does not, and parts of it have smaller ones.
ASKEW = 1.0 / 64.0
MOST_PARTS = 1 << 12  # that triangles are taken apart into
_MORTON_BITS = 10  # per axis
_KIND_BIT = 8  # of a class, above its size

# What triangles in a box may be: bits of `Boxes.kinds`.
MASKED, NORMAL_MAPPED, MOVING = 1, 2, 4

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Boxes:
    """Axis-aligned boxes, m, world, that together hold every point of the scene at any time."""

    centre: F64  # (n, 3)
    half: F64  # (n, 3) half their sizes
    kinds: NDArray[np.uint8]  # (n,) bits

    def kinds_of(self, chosen: NDArray[np.bool_]) -> int:
        """All the bits of some of them (n,)."""
        return int(np.bitwise_or.reduce(self.kinds[chosen], initial=0))

    def farthest_from(self, place: F64) -> float:
        """Largest coordinate of any of their points from a place, m."""
        return float((np.abs(self.centre - place) + self.half).max(initial=0.0))

    def distance_from(self, place: ArrayLike) -> float:
        """Of the nearest of them to a place, m: 0 inside one, infinity where there is none."""
        apart = np.maximum(np.abs(self.centre - np.asarray(place, np.float64)) - self.half, 0.0)
        return float(np.linalg.norm(apart, axis=1).min(initial=np.inf))


def single_box(low: Sequence[float], high: Sequence[float]) -> Boxes:
    """One box that may hold anything."""
    ends = np.asarray([low, high], np.float64)
    return Boxes(ends.mean(axis=0)[None], 0.5 * (ends[1:] - ends[:1]), np.full(1, 255, np.uint8))


def scene_boxes(triangles: Triangles, materials: Sequence[Material]) -> Boxes:
    """Boxes of what stands still, at most MOST_BOXES of each kind's share, then one per moving object around all that
    it passes through.
    """
    bits = np.array([_kind(material) for material in materials], np.uint8)
    kinds = bits[triangles.materials[triangles.indices[:, 0]]] if len(triangles.indices) else np.zeros(0, np.uint8)
    objects = triangles.objects[triangles.indices[:, 0]]
    standing = objects == 0
    low, high, of_box = _clustered(*_triangle_boxes(triangles, standing, kinds[standing]))
    moving = [int(np.bitwise_or.reduce(kinds[objects == i + 1], initial=MOVING)) for i in range(len(triangles.moving))]
    return _joined(low + triangles.origin, high + triangles.origin, of_box, triangles.moving, moving)


def _kind(material: Material) -> int:
    return MASKED * (material.alpha_cutoff is not None) + NORMAL_MAPPED * (material.normal_texture is not None)


def _joined(
    low: F64, high: F64, kinds: NDArray[np.uint8], moving: Sequence[MovingObject], moving_kinds: Sequence[int]
) -> Boxes:
    lows = np.concatenate([low, *(m.low[None] for m in moving)])
    highs = np.concatenate([high, *(m.high[None] for m in moving)])
    return Boxes(
        0.5 * (lows + highs), 0.5 * (highs - lows), np.concatenate([kinds, np.array(moving_kinds, np.uint8)])
    )


def _triangle_boxes(
    triangles: Triangles, chosen: NDArray[np.bool_], kinds: NDArray[np.uint8]
) -> tuple[F64, F64, NDArray[np.uint8]]:
    """Lowest and highest corners (k, 3) of some triangles or of parts of them, about the scene's origin, and their
    kinds.
    """
    corners = triangles.positions[triangles.indices[chosen]].astype(np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    size = high - low
    askew = np.flatnonzero(size.min(axis=1) > ASKEW * _extent(low, high))
    parts, of_part = _apart(corners[askew], kinds[askew], ASKEW * _extent(low, high))
    whole = np.ones(len(low), np.bool_)
    whole[askew] = False
    return (
        np.concatenate([low[whole], parts.min(axis=1)]),
        np.concatenate([high[whole], parts.max(axis=1)]),
        np.concatenate([kinds[whole], of_part]),
    )


def _extent(low: F64, high: F64) -> float:
    """Longest side of a box around all."""
    return float((high.max(axis=0) - low.min(axis=0)).max()) if len(low) else 0.0


def _apart(corners: F64, kinds: NDArray[np.uint8], deep: float) -> tuple[F64, NDArray[np.uint8]]:
    """Triangles (k, 3, 3) cut in four at the middles of their edges while their boxes are deeper than `deep` along
    every axis, and there are not too many.
    """
    done, done_kinds = [corners[:0]], [kinds[:0]]
    while len(corners) and 4 * len(corners) + sum(map(len, done)) <= MOST_PARTS:
        middle = 0.5 * (corners + np.roll(corners, -1, axis=1))  # of the edges 01, 12, 20
        a, b, c = np.moveaxis(corners, 1, 0)
        ab, bc, ca = np.moveaxis(middle, 1, 0)
        corners = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        kinds = np.tile(kinds, 4)
        askew = np.ptp(corners, axis=1).min(axis=1) > deep
        done.append(corners[~askew])
        done_kinds.append(kinds[~askew])
        corners, kinds = corners[askew], kinds[askew]
    return np.concatenate([*done, corners]), np.concatenate([*done_kinds, kinds])


def _clustered(low: F64, high: F64, kinds: NDArray[np.uint8]) -> tuple[F64, F64, NDArray[np.uint8]]:
    """At most MOST_BOXES boxes (or one per kind) around many, of one kind each."""
    if not len(low):
        return low, high, kinds
    order, classes = _neighbours(low, high, kinds)
    low, high, kinds = low[order], high[order], kinds[order]
    starts = _runs(classes)
    low, high, kinds = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts), kinds[starts]
    clusters = _split(low, high, [np.flatnonzero(kinds == kind) for kind in np.unique(kinds)])
    return (
        np.stack([low[c].min(axis=0) for c in clusters]),
        np.stack([high[c].max(axis=0) for c in clusters]),
        np.array([kinds[c[0]] for c in clusters], np.uint8),
    )


def _neighbours(low: F64, high: F64, kinds: NDArray[np.uint8]) -> tuple[Index, Index]:
    """The order by kind, size and place on a Morton curve (Morton 1966), and in it a number that changes where one of
    the first two does.
    """
    origin, extent = low.min(axis=0), max(_extent(low, high), 1e-30)
    share = np.clip((0.5 * (low + high) - origin) / extent, 0.0, 1.0)
    cells = np.minimum((share * (1 << _MORTON_BITS)).astype(np.uint64), (1 << _MORTON_BITS) - 1)
    code = np.zeros(len(low), np.uint64)
    for axis in range(3):
        code |= _spread(cells[:, axis]) << np.uint64(axis)
    size = np.maximum((high - low).max(axis=1) / extent, 4.0**-SIZE_CLASSES)
    klass = np.clip(np.floor(-np.log2(size) / 2.0), 0, SIZE_CLASSES - 1).astype(np.uint64)
    klass |= kinds.astype(np.uint64) << np.uint64(_KIND_BIT)
    order = np.argsort(code | klass << np.uint64(3 * _MORTON_BITS), kind="stable")
    return order, klass[order].astype(np.intp)


def _spread(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Ten bits, two zeros between any two of them."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        bits = (bits | bits << np.uint64(shift)) & np.uint64(mask)
    return bits


def _runs(classes: Index) -> Index:
    """Where runs of one class begin: of a single triangle while half the groups that are left suffice for its class,
    the largest triangles' first, and longer ones after that.
    """
    begins = np.flatnonzero(np.diff(classes, prepend=classes[0] - 1))
    counts, left, lengths = np.diff(begins, append=len(classes)), MOST_GROUPS, np.ones(len(begins), np.intp)
    for i in np.argsort(classes[begins] % (1 << _KIND_BIT), kind="stable"):
        lengths[i] = -(-counts[i] // max(left // 2, 1))
        left -= -(-counts[i] // lengths[i])
    since = np.arange(len(classes)) - np.repeat(begins, counts)
    return np.flatnonzero(since % np.repeat(lengths, counts) == 0)


def _split(low: F64, high: F64, clusters: list[Index]) -> list[Index]:
    """Clusters of boxes, cut in two over and over, always the one with the largest surface, until there are MOST_BOXES
    of them.
    """
    queue = [(-_area(low[c].min(axis=0), high[c].max(axis=0)), i, c) for i, c in enumerate(clusters)]
    heapq.heapify(queue)
    done: list[Index] = []
    name = len(clusters)
    while queue and len(queue) + len(done) < MOST_BOXES:
        _, _, cluster = heapq.heappop(queue)
        if len(cluster) == 1:
            done.append(cluster)
            continue
        for part in _halves(low, high, cluster):
            heapq.heappush(queue, (-_area(low[part].min(axis=0), high[part].max(axis=0)), name, part))
            name += 1
    return [*done, *(cluster for _, _, cluster in queue)]


def _halves(low: F64, high: F64, cluster: Index) -> tuple[Index, Index]:
    """The cut, along the axis and at the place, of the least surface area heuristic."""
    ordered = cluster[np.argsort((low[cluster] + high[cluster]).T, axis=1, kind="stable")]  # (3, k)
    back = ordered[:, ::-1]
    left, right = (
        _area(np.minimum.accumulate(low[o], axis=1), np.maximum.accumulate(high[o], axis=1)) for o in (ordered, back)
    )
    counts = np.arange(1, len(cluster))
    cost = left[:, :-1] * counts + right[:, -2::-1] * counts[::-1]
    axis, place = divmod(int(np.argmin(cost)), len(counts))
    return ordered[axis, : place + 1], ordered[axis, place + 1 :]


def _area(low: F64, high: F64) -> F64:
    """(...,) half the surfaces of boxes; a point's is 0."""
    size = high - low
    x, y, z = size[..., 0], size[..., 1], size[..., 2]
    return np.asarray(x * y + y * z + z * x)
