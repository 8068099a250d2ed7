"""How the tree lies in GPU memory: 64-byte two-child nodes, 32-bit child references, triangles in leaf order.

A node holds the boxes of both its children, so that one fetch decides both (Aila and Laine 2009, section 3). Vertex
coordinates are float32, and minima and maxima of float32 are exact: boxes need no outward rounding when packed. What
the ray test itself rounds is covered there (`glsl/lib/intersect.glsl`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

LEAF_BIT = 1 << 31  # set: a leaf; clear: the index of an inner node
FIRST_BITS = 28  # bits 0..27 of a leaf: its first triangle, in leaf order
MAX_TRIANGLES = 1 << FIRST_BITS
MAX_LEAF = 1 << (31 - FIRST_BITS)  # bits 28..30 of a leaf: its triangle count - 1
NO_CHILD = 0xFFFFFFFF  # both children of the tree without triangles: the traversal ends there

# Name -> (GLSL type, meaning): `app/gpu/layout.py` prints this as the GLSL struct.
BVH_NODE_FIELDS: dict[str, tuple[str, str]] = {
    "x": ("vec4", "lo and hi of child 0, lo and hi of child 1, m"),
    "y": ("vec4", "the same along y"),
    "z": ("vec4", "the same along z"),
    "child": ("uvec4", "x, y: references to child 0 and 1 (app/bvh/pack.py); z, w: unused"),
}

BVH_NODE = np.dtype([("x", "<f4", 4), ("y", "<f4", 4), ("z", "<f4", 4), ("child", "<u4", 4)])
assert BVH_NODE.itemsize == 64


def leaf_reference(first: NDArray[Any], count: NDArray[Any]) -> NDArray[np.uint32]:
    """References to leaves of `count` (1..8) triangles that start at `first` in leaf order."""
    bits = LEAF_BIT | (count.astype(np.int64) - 1) << FIRST_BITS | first.astype(np.int64)
    return bits.astype(np.uint32)


def is_leaf(reference: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """True for leaves, False for inner nodes and for `NO_CHILD`."""
    leaf: NDArray[np.bool_] = (reference >= LEAF_BIT) & (reference != NO_CHILD)
    return leaf


def leaf_range(reference: NDArray[np.uint32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(first, count) of leaf references: the inverse of `leaf_reference`."""
    bits = reference.astype(np.int64)
    return bits & (MAX_TRIANGLES - 1), ((bits >> FIRST_BITS) & (MAX_LEAF - 1)) + 1


def empty_nodes(count: int) -> NDArray[Any]:
    """`count` BVH_NODE records whose children are all missing."""
    nodes = np.zeros(count, BVH_NODE)
    nodes["child"][:, :2] = NO_CHILD
    return nodes


def set_children(
    nodes: NDArray[Any], slot: NDArray[np.intp], reference: NDArray[np.uint32], box: NDArray[np.float32]
) -> None:
    """Writes references and boxes (6, k) as (lo, -hi) into slots `2 * parent + child`."""
    parent, child = slot >> 1, slot & 1
    nodes["child"][parent, child] = reference
    for axis, name in enumerate("xyz"):
        nodes[name][parent, 2 * child] = box[axis]
        nodes[name][parent, 2 * child + 1] = -box[3 + axis]


def child_boxes(nodes: NDArray[Any]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(lo, hi) of the children, each (n, 2 children, 3 axes), m."""
    planes = np.stack([nodes["x"], nodes["y"], nodes["z"]], axis=-1)  # (n, lo0 hi0 lo1 hi1, axis)
    return planes[:, 0::2], planes[:, 1::2]


def pack_triangles(
    order: NDArray[np.uint32], indices: NDArray[np.uint32], materials: NDArray[np.uint32]
) -> NDArray[np.uint32]:
    """Triangles in leaf order as (m, 4) uint32: three vertex indices and the material of the first vertex."""
    vertices = indices[order]
    return np.column_stack([vertices, materials[vertices[:, 0]]]).astype(np.uint32)


def pack_triangle_positions(
    order: NDArray[np.uint32], positions: NDArray[np.float32], indices: NDArray[np.uint32]
) -> NDArray[np.float32]:
    """Vertex positions in leaf order as (m, 3, 4) float32, m, w = 0.

    A copy that saves the traversal two dependent fetches a triangle: 10-40 % faster on llvmpipe, for 48 bytes each.
    """
    packed = np.zeros((len(order), 3, 4), np.float32)
    packed[..., :3] = positions[indices[order]]
    return packed
