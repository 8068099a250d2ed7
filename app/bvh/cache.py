"""Trees on disk, keyed by what they were built from, so that a scene opens quickly the second time.

Where the cache fails (app/cache.py), the tree is built, and a note says why.
"""

from __future__ import annotations

from dataclasses import asdict
from hashlib import blake2b
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..cache import CACHE_VARIABLE, FAILURES, cache_folder, drop_oldest, used, write_arrays
from . import build
from .build import Bvh, BvhStats, Progress, build_bvh
from .pack import BVH_NODE, is_inner, is_leaf, leaf_range, tree_depth
from .split import F32

__all__ = ["CACHE_VARIABLE", "cache_dir", "cached_tree", "content_key", "load_or_build"]

SIZE_LIMIT = 2 << 30  # bytes: about 30 scenes of a million triangles
_SUFFIX = ".bvh.npz"


def cache_dir() -> Path:
    """The folder trees are kept in; it need not exist."""
    return cache_folder("bvh")


def load_or_build(
    positions: F32, indices: NDArray[np.uint32], progress: Progress | None = None
) -> tuple[Bvh, tuple[str, ...]]:
    """The tree of `build_bvh`, from the cache where possible, and notes on what went wrong with the cache.

    Raises ValueError as `build_bvh` does.
    """
    path = cache_dir() / (content_key(positions, indices) + _SUFFIX)
    notes: list[str] = []
    if path.is_file():
        try:
            bvh = _read(path, len(indices))
            used(path)
            return bvh, ()
        except FAILURES as error:
            notes.append(f"the cached ray hierarchy {path.name} is unreadable and was built again ({error})")
    bvh = build_bvh(positions, indices, progress)
    try:
        _write(path, bvh)
        drop_oldest(path.parent, _SUFFIX, SIZE_LIMIT)
    except FAILURES as error:
        notes.append(f"the ray hierarchy could not be cached ({error})")
    return bvh, tuple(notes)


def cached_tree(positions: F32, indices: NDArray[np.uint32], progress: Progress | None = None) -> Bvh:
    """The tree of `load_or_build` alone."""
    return load_or_build(positions, indices, progress)[0]


def content_key(positions: F32, indices: NDArray[np.uint32]) -> str:
    """A hash of everything the tree depends on: geometry, builder version and parameters."""
    builder = (build.BUILDER_VERSION, build.LEAF_SIZE, build.NODE_COST, build.MAX_DEPTH)
    digest = blake2b(repr((builder, positions.shape, indices.shape)).encode(), digest_size=16)
    digest.update(np.ascontiguousarray(positions, np.float32).data)
    digest.update(np.ascontiguousarray(indices, np.uint32).data)
    return digest.hexdigest()


def _read(path: Path, triangles: int) -> Bvh:
    with np.load(path, allow_pickle=False) as data:
        nodes, order, depth = data["nodes"].view(BVH_NODE)[:, 0], data["order"], int(data["depth"])
        stats = BvhStats(int(data["inner_nodes"]), int(data["leaves"]), float(data["sah_cost"]), float(data["seconds"]))
    if order.shape != (triangles,) or order.dtype != np.uint32 or len(nodes) != stats.inner_nodes:
        raise ValueError("the arrays do not fit the scene")
    if not _whole(nodes, order, depth):
        raise ValueError("the tree refers to what is not there")
    return Bvh(nodes, order, depth, stats)


def _whole(nodes: NDArray[np.void], order: NDArray[np.uint32], depth: int) -> bool:
    """Whether rays can follow the tree blindly: every node but the root has one parent, before itself, every triangle
    is in one leaf, and no path is longer than said.
    """
    child = nodes["child"]
    inner, leaf = is_inner(child), is_leaf(child)
    if not np.array_equal(child[inner], np.arange(1, len(nodes))):  # as `widened` counts them, level after level
        return False
    first, count = leaf_range(child[leaf])
    by_place = np.argsort(first)
    ends = np.cumsum(count[by_place])
    in_leaves = np.array_equal(first[by_place], ends - count[by_place]) and count.sum() == len(order)
    each_once = order.max(initial=0) < max(len(order), 1) and (np.bincount(order, minlength=len(order)) == 1).all()
    finite = all(np.isfinite(nodes[name]).all() for name in ("origin", "step_x", "step_y", "step_z"))
    return bool(in_leaves and each_once and finite and tree_depth(nodes) == depth)


def _write(path: Path, bvh: Bvh) -> None:
    nodes = bvh.nodes.view(np.uint8).reshape(len(bvh.nodes), BVH_NODE.itemsize)
    write_arrays(path, nodes=nodes, order=bvh.order, depth=bvh.depth, **asdict(bvh.stats))
