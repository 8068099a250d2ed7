"""A few hundred boxes around everything that can be seen: what a frame's facts test against the view.

Made once, when a scene is loaded, from triangles alone: facts are wanted long before any ray asks for its tree.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .model import F64, Material, Triangles

MOST_BOXES = 512  # a frame's facts then cost a tenth of a millisecond
MOST_RUNS = (
    1 << 16
)  # of triangles that follow each other in the file, where neighbours mostly do: what boxes are made of

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


def single_box(low: Sequence[float], high: Sequence[float]) -> Boxes:
    """One box that may hold anything, for a scene about the world's origin."""
    return boxes_between(np.array([low], float), np.array([high], float), np.full(1, ANYTHING, np.uint8), np.zeros(3))


def scene_boxes(triangles: Triangles, materials: Sequence[Material]) -> Boxes:
    """At most MOST_BOXES boxes: around triangles that stand still, and around all that moving objects pass through."""
    of_material = np.array([_kind(material) for material in materials], np.uint8)
    first = triangles.indices[:, 0]
    kinds, objects = of_material[triangles.materials[first]], triangles.objects[first]
    low, high, run_kinds = _runs(triangles, kinds, np.flatnonzero(objects == 0))
    moving_kinds = np.zeros(len(triangles.moving), np.uint8)
    np.bitwise_or.at(moving_kinds, objects[objects > 0] - 1, kinds[objects > 0])
    low = np.concatenate([low, *(m.low[None] for m in triangles.moving)])
    high = np.concatenate([high, *(m.high[None] for m in triangles.moving)])
    return _clustered(low, high, np.concatenate([run_kinds, moving_kinds]), triangles.origin)


def _kind(material: Material) -> int:
    return ALPHA_MASKED * (material.alpha_cutoff is not None) + NORMAL_MAPPED * (material.normal_texture is not None)


def _runs(triangles: Triangles, kinds: Kinds, chosen: Index) -> tuple[F64, F64, Kinds]:
    """Corners (k, 3) and kinds (k,) of boxes around runs of some triangles, kind by kind, m, world."""
    chosen = chosen[np.argsort(kinds[chosen], kind="stable")]
    starts = np.arange(0, len(chosen), max(1, -(-len(chosen) // MOST_RUNS)))
    if not len(starts):
        return np.zeros((0, 3)), np.zeros((0, 3)), kinds[:0]
    corners = triangles.positions[triangles.indices[chosen].ravel()]
    low, high = (reduce.reduceat(corners, 3 * starts) + triangles.origin for reduce in (np.minimum, np.maximum))
    return low, high, np.bitwise_or.reduceat(kinds[chosen], starts)


def _clustered(low: F64, high: F64, kinds: Kinds, origin: F64) -> Boxes:
    """At most MOST_BOXES boxes around many, of one kind each: always the cluster with the largest surface is cut in
    two.
    """
    clusters = [np.flatnonzero(kinds == kind) for kind in np.unique(kinds)]
    queue = [(-_surface(low, high, cluster), i, cluster) for i, cluster in enumerate(clusters)]
    heapq.heapify(queue)
    done = list[Index]()
    name = len(queue)  # never are two clusters compared themselves
    while queue and len(queue) + len(done) < MOST_BOXES:
        cluster = heapq.heappop(queue)[2]
        parts = _halves(low, high, cluster)
        if len(parts) == 1:
            done.append(cluster)
            continue
        for part in parts:
            heapq.heappush(queue, (-_surface(low, high, part), name, part))
            name += 1
    done += [cluster for _, _, cluster in queue]
    lows = np.array([low[c].min(axis=0) for c in done]).reshape(-1, 3)
    highs = np.array([high[c].max(axis=0) for c in done]).reshape(-1, 3)
    return boxes_between(lows, highs, np.array([kinds[c[0]] for c in done], np.uint8), origin)


def _halves(low: F64, high: F64, cluster: Index) -> list[Index]:
    """The boxes on either side of the middle of their centres, along the axis on which these lie farthest apart."""
    centres = low[cluster] + high[cluster]
    ends = centres.min(axis=0), centres.max(axis=0)
    axis = int(np.argmax(ends[1] - ends[0]))
    left = centres[:, axis] < 0.5 * (ends[0][axis] + ends[1][axis])
    return [cluster[left], cluster[~left]] if left.any() else [cluster]


def _surface(low: F64, high: F64, cluster: Index) -> float:
    """Half the surface of a box around some of them, m^2."""
    x, y, z = high[cluster].max(axis=0) - low[cluster].min(axis=0)
    return float(x * y + y * z + z * x)
