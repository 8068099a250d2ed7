"""How the tree lies in GPU memory: 64-byte four-child nodes, 32-bit child references, triangles in leaf order.

A node holds the boxes of its children, so that one fetch decides all four, on a grid of its own: a plane is a byte that
counts steps from the grid's origin. Idea: Ylitie, Karras and Laine 2017, "Efficient incoherent ray traversal on GPUs
through compressed wide BVHs", section 3.1.

Boxes grow to the grid, never shrink, and lose nothing by decoding. Steps are powers of two, and planes are whole
numbers of them: float32 coordinates rounded outward to such a multiple, which never takes more bits. So origin, plane
and all between are exact in float32. What the ray test itself rounds is covered there (`glsl/lib/intersect.glsl`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .split import F32

LEAF_BIT = 1 << 31  # set: a leaf; clear: the index of an inner node
FIRST_BITS = 28  # bits 0..27 of a leaf: its first triangle, in leaf order
MAX_TRIANGLES = 1 << FIRST_BITS
MAX_LEAF = 1 << (31 - FIRST_BITS)  # bits 28..30 of a leaf: its triangle count - 1
NO_CHILD = 0xFFFFFFFF  # where a node has fewer children than four

FIRST_TURN = 0x40000000  # the bits of 2.0; the last turn's are 0x4fffffff

WIDTH = 4  # children of a node
STACK_DEPTH = 48  # nodes on a path: 145 entries of a ray's stack, 580 bytes
LAST_PLANE = 255  # of a grid
SMALLEST_STEP = -100  # exponent, 8e-31 m: a step over a direction's component stays above the denormal numbers

# Name -> (GLSL type, meaning): `app/gpu/layout.py` prints this as the GLSL struct.
BVH_NODE_FIELDS: dict[str, tuple[str, str]] = {
    "origin": ("vec3", "first planes of the grid, m"),
    "step_x": ("float", "from a plane of the grid to the next, m"),
    "low": ("uvec3", "the boxes' low planes along x, y and z: a byte for each child, child 0 in the lowest"),
    "step_y": ("float", ""),
    "high": ("uvec3", "their high planes"),
    "step_z": ("float", ""),
    "child": ("uvec4", "references to the children (app/bvh/pack.py)"),
}

BVH_NODE = np.dtype(
    [
        ("origin", "<f4", 3),
        ("step_x", "<f4"),
        ("low", "<u4", 3),
        ("step_y", "<f4"),
        ("high", "<u4", 3),
        ("step_z", "<f4"),
        ("child", "<u4", WIDTH),
    ]
)
assert BVH_NODE.itemsize == 64
_STEPS = ("step_x", "step_y", "step_z")


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


def is_inner(reference: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """True for inner nodes: the reference is then a node's index."""
    inner: NDArray[np.bool_] = reference < LEAF_BIT
    return inner


def stack_entries(depth: int) -> int:
    """What a walk down `depth` nodes may have to remember: all but one child of each, and where to end.

    Raises ValueError where that is more than shaders may keep for a ray.
    """
    if depth > STACK_DEPTH:
        raise ValueError(f"the ray hierarchy is {depth} nodes deep; at most {STACK_DEPTH} fit the stack of a ray")
    return (WIDTH - 1) * depth + 1


def tree_depth(nodes: NDArray[Any]) -> int:
    """Most nodes on a path from the first. Raises ValueError unless each of `nodes` is reached once."""
    level, depth, reached = np.zeros(1, np.intp), 0, 0
    while level.size:
        depth, reached = depth + 1, reached + level.size
        if reached > len(nodes) or level.max() >= len(nodes):
            raise ValueError("its nodes are no tree")
        reference = nodes["child"][level]
        level = reference[is_inner(reference)].astype(np.intp)
    if reached != len(nodes):
        raise ValueError("its nodes are no tree")
    return depth


def empty_nodes(count: int) -> NDArray[Any]:
    """`count` BVH_NODE records whose children are all missing."""
    nodes = np.zeros(count, BVH_NODE)
    nodes["child"] = NO_CHILD
    return nodes


def pack_nodes(reference: NDArray[np.uint32], box: F32) -> NDArray[Any]:
    """(n,) BVH_NODE records with children `reference` (n, 4) in boxes (6, n, 4) [m] as in split.py."""
    nodes = empty_nodes(len(reference))
    nodes["child"] = reference
    absent = reference == NO_CHILD
    low, high = box[:3].astype(np.float64), -box[3:].astype(np.float64)  # (3, n, 4)
    lowest = np.where(absent, np.inf, low).min(axis=2, keepdims=True)
    highest = np.where(absent, -np.inf, high).max(axis=2, keepdims=True)
    lowest, highest = (np.where(absent.all(axis=1)[:, None], 0.0, edge) for edge in (lowest, highest))
    step = _grid_steps(lowest, highest)
    first = np.floor(lowest / step)  # dividing by a power of two is exact
    nodes["origin"] = (first * step)[..., 0].T
    for name, axis in zip(_STEPS, step[..., 0], strict=True):
        nodes[name] = axis
    for name, plane in (("low", np.floor(low / step)), ("high", np.ceil(high / step))):
        on_grid = np.where(absent, 0.0, plane - first).astype(np.uint8, order="C")
        nodes[name] = on_grid.view("<u4")[..., 0].T
    return nodes


def child_boxes(nodes: NDArray[Any]) -> tuple[F32, F32]:
    """(low, high) corners of the children's boxes, each (n, 4 children, 3 axes), m, decoded in float32."""
    step = np.stack([nodes[name] for name in _STEPS], axis=1)  # (n, 3)
    bytes_of = (np.ascontiguousarray(nodes[name]).view(np.uint8).reshape(-1, 3, WIDTH) for name in ("low", "high"))
    low, high = (nodes["origin"][:, None] + np.swapaxes(plane, 1, 2) * step[:, None] for plane in bytes_of)
    return low, high


def _grid_steps(lowest: NDArray[np.float64], highest: NDArray[np.float64]) -> NDArray[np.float64]:
    """The smallest powers of two [m] of which LAST_PLANE reach from a multiple below lowest to one above highest."""
    spanning = (highest - lowest) / (LAST_PLANE - 2)  # both ends are rounded outward, each by less than a step
    exponent = np.where(spanning > 0, np.frexp(spanning)[1], SMALLEST_STEP)
    steps: NDArray[np.float64] = np.ldexp(1.0, np.maximum(exponent, SMALLEST_STEP))
    return steps


def pack_triangles(
    order: NDArray[np.uint32], indices: NDArray[np.uint32], materials: NDArray[np.uint32]
) -> NDArray[np.uint32]:
    """Triangles in leaf order as (m, 4) uint32: three vertex indices and the material of the first vertex."""
    vertices = indices[order]
    return np.column_stack([vertices, materials[vertices[:, 0]]]).astype(np.uint32)


def pack_triangle_positions(
    order: NDArray[np.uint32], positions: F32, indices: NDArray[np.uint32], drawn: NDArray[np.integer]
) -> F32:
    """Vertex positions in leaf order as (m, 3, 4) float32, m; w of a triangle's first vertex: its turn.

    `drawn` (m,) says at which place each triangle is drawn. A copy that saves the traversal two dependent fetches a
    triangle: 10-40 % faster on llvmpipe, for 48 bytes each.
    """
    packed = np.zeros((len(order), 3, 4), np.float32)
    packed[..., :3] = positions[indices[order]]
    packed[:, 0, 3] = turns(drawn[order])
    return packed


def turns(drawn: NDArray[np.integer]) -> F32:
    """Places in the order of drawing as floats that sort as they do: at equal distances a ray hits the lowest.

    Bits, not values: float32 could count no farther than 2^24. From 2.0 on none is denormal, infinite or NaN.
    """
    return (drawn.astype(np.uint32) + np.uint32(FIRST_TURN)).view(np.float32)


def from_lowest_corner(positions: F32, indices: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The same triangles (m, 3), wound as they are, each beginning with the corner that is lowest in x, then y, then z.

    Copies of one triangle then get the same distance from the ray test, to the last bit.
    """
    lowest = np.ones(indices.shape, np.bool_)
    for axis in range(3):
        place = np.where(lowest, positions[indices, axis], np.inf)
        lowest = place == place.min(axis=1, keepdims=True)
    begin = lowest.argmax(axis=1)
    rotated: NDArray[np.uint32] = np.take_along_axis(indices, (begin[:, None] + np.arange(3)) % 3, axis=1)
    return rotated
