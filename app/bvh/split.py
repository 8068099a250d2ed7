"""Where to cut: binned surface area heuristic for all nodes of one tree level at once.

Method: Wald 2007, "On fast construction of SAH-based bounding volume hierarchies", sections 3-4: centroids fall into
equal bins along each axis, boxes are summed from both ends, the cheapest plane between two bins wins. A node here is a
segment of consecutive triangles, so that every step is one array operation over all segments.

Boxes are stored as six rows, (lo x, y, z, -hi x, y, z): one minimum then serves both ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
Index = NDArray[np.intp]

# (bins, smallest node that gets them). Bins beyond the number of triangles buy nothing and cost memory per node.
BIN_CLASSES: tuple[tuple[int, int], ...] = ((32, 1024), (16, 32), (8, 8), (4, 0))

SMALLEST_EXTENT = np.float32(1e-35)  # m: its inverse times the number of bins stays finite


@dataclass(frozen=True)
class Segments:
    """Consecutive runs of triangles, one per node: `count[i]` triangles from `first[i]` in the level's own arrays."""

    count: Index  # (k,) all > 0
    first: Index  # (k,)
    owner: Index  # (n,) the node of each triangle

    @staticmethod
    def of(count: Index) -> Segments:
        return Segments(count, np.cumsum(count) - count, np.repeat(np.arange(count.size), count))

    def minimum(self, rows: F32) -> F32:
        """Minimum of each row over each segment: (r, n) -> (r, k)."""
        return np.stack([np.minimum.reduceat(row, self.first) for row in rows])

    def rank(self) -> Index:
        """Position of each triangle within its own segment, (n,)."""
        return np.arange(self.owner.size) - self.first[self.owner]


@dataclass(frozen=True)
class Split:
    """The best plane of each node; `cost` is inf where no plane separates the centroids."""

    cost: F32  # (k,) sum over both sides of half area * triangle count
    right: NDArray[np.bool_]  # (n,) True for triangles beyond the plane


def half_area(box: F32) -> F32:
    """Half the surface area of boxes (6, ...); 0 for empty ones."""
    x, y, z = np.maximum(-(box[:3] + box[3:]), np.float32(0))
    area: F32 = x * y + y * z + z * x
    return area


def best_splits(segments: Segments, box: F32, centroid: F32) -> Split:
    """The cheapest binned SAH plane of every node. `box` (6, n), `centroid` (3, n), in units of the scene's size."""
    cost = np.empty(segments.count.size, np.float32)
    right = np.empty(segments.owner.size, np.bool_)
    ceiling = np.iinfo(np.intp).max
    for bins, smallest in BIN_CLASSES:
        nodes = (segments.count >= smallest) & (segments.count < ceiling)
        ceiling = smallest
        if nodes.all():
            return _split_with(bins, segments, box, centroid)
        if nodes.any():
            members = np.flatnonzero(nodes[segments.owner])
            part = Segments.of(segments.count[nodes])
            split = _split_with(bins, part, box[:, members], centroid[:, members])
            cost[nodes], right[members] = split.cost, split.right
    return Split(cost, right)


def _split_with(bins: int, segments: Segments, box: F32, centroid: F32) -> Split:
    bin_of = _bin_indices(bins, segments, centroid)
    best = np.full(segments.count.size, np.inf, np.float32)
    plane = np.zeros(segments.count.size, np.uint8)
    axis = np.zeros(segments.count.size, np.uint8)
    for candidate in range(3):
        cost = _plane_costs(bins, segments, box, bin_of[candidate])
        cheapest = np.argmin(cost, axis=0)
        value = cost[cheapest, np.arange(cheapest.size)]
        better = value < best  # strict: ties keep the lower axis, so that the same input gives the same tree
        best[better], plane[better], axis[better] = value[better], cheapest[better], candidate
    chosen = np.where(axis[segments.owner] == 0, bin_of[0], np.where(axis[segments.owner] == 1, bin_of[1], bin_of[2]))
    return Split(best, chosen > plane[segments.owner])


def _bin_indices(bins: int, segments: Segments, centroid: F32) -> NDArray[np.uint8]:
    """Bin of each triangle along each axis, (3, n). An axis along which all centroids coincide puts all in bin 0."""
    result = np.empty(centroid.shape, np.uint8)
    for axis, c in enumerate(centroid):
        lo = np.minimum.reduceat(c, segments.first)
        extent = np.maximum.reduceat(c, segments.first) - lo
        # Extents too small to invert in float32 count as none: all centroids then share a bin.
        scale = np.where(extent > SMALLEST_EXTENT, bins / np.maximum(extent, SMALLEST_EXTENT), 0).astype(np.float32)
        position = (c - lo[segments.owner]) * scale[segments.owner]
        result[axis] = np.minimum(position, bins - 1)
    return result


def _plane_costs(bins: int, segments: Segments, box: F32, bin_of: NDArray[np.uint8]) -> F32:
    """SAH cost of each plane between two bins, (bins - 1, k); inf where one side would be empty."""
    nodes = segments.count.size
    cell = bin_of.astype(np.intp) * nodes + segments.owner  # bin-major: sums over bins then run over whole rows
    boxes: F32 = np.full((6, bins, nodes), np.inf, np.float32)
    for target, row in zip(boxes.reshape(6, -1), box, strict=True):
        np.minimum.at(target, cell, row)
    count = np.bincount(cell, minlength=bins * nodes).reshape(bins, nodes).astype(np.float32)
    left_count = np.cumsum(count, axis=0)[:-1]
    right_count = segments.count.astype(np.float32) - left_count
    cost = half_area(_running_minimum(boxes.copy())[:, :-1]) * left_count
    cost += half_area(_running_minimum(boxes[:, ::-1])[:, -2::-1]) * right_count
    cost[(left_count == 0) | (right_count == 0)] = np.inf
    return cost


def _running_minimum(boxes: F32) -> F32:
    """Minimum over all bins up to each, in place: `np.minimum.accumulate(axis=1)`, which numpy does not vectorise."""
    for this in range(1, boxes.shape[1]):
        np.minimum(boxes[:, this], boxes[:, this - 1], out=boxes[:, this])
    return boxes
