"""From two children a node to four: fewer nodes on a ray's way, each tested with one fetch.

Method: a node takes the place of its child with the largest box, the one that rays would most often have to open, until
there are four (Wald, Benthin and Boulos 2008, "Getting rid of packets", section 3.1). One tree level at a time, all its
nodes at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .pack import NO_CHILD, WIDTH, is_inner
from .split import F32, Index, half_area


@dataclass(frozen=True)
class Children:
    """Inner nodes, root first, by what they hold; missing children are NO_CHILD in any box."""

    reference: NDArray[np.uint32]  # (n, children of a node), as in pack.py
    box: F32  # (6, n, children of a node) as in split.py, m

    @staticmethod
    def missing(nodes: int, width: int) -> Children:
        """Nodes that hold nothing yet."""
        return Children(np.full((nodes, width), NO_CHILD, np.uint32), np.zeros((6, nodes, width), np.float32))

    def put(self, slot: Index, reference: NDArray[np.uint32], box: F32) -> None:
        """Sets children `slot` (k,), counted through all nodes, to `reference` (k,) and boxes (6, k)."""
        self.reference.reshape(-1)[slot] = reference
        self.box.reshape(6, -1)[:, slot] = box


def widened(binary: Children) -> tuple[Children, int]:
    """The same leaves under nodes of four children, level after level, and the most nodes on a path."""
    levels: list[Children] = []
    used, level = 1, np.zeros(1, np.intp)
    while level.size:
        wide = _with_grandchildren(binary, level)
        inner = is_inner(wide.reference)
        level = wide.reference[inner].astype(np.intp)
        wide.reference[inner] = np.arange(used, used + level.size)
        used += level.size
        levels.append(wide)
    reference, box = np.concatenate([w.reference for w in levels]), np.concatenate([w.box for w in levels], axis=1)
    return Children(reference, box), len(levels)


def _with_grandchildren(binary: Children, nodes: Index) -> Children:
    """Four children for each of `nodes` (k,), still named as in the binary tree."""
    wide = Children.missing(nodes.size, WIDTH)
    wide.reference[:, :2] = binary.reference[nodes]
    wide.box[..., :2] = binary.box[:, nodes]
    for held in range(2, WIDTH):
        area = np.where(is_inner(wide.reference), half_area(wide.box), np.float32(-1))
        largest = area.argmax(axis=1)
        rows = np.flatnonzero(area.max(axis=1) >= 0)
        largest = largest[rows]
        opened = wide.reference[rows, largest]
        for child, place in ((0, largest), (1, held)):
            wide.reference[rows, place] = binary.reference[opened, child]
            wide.box[:, rows, place] = binary.box[:, opened, child]
    return wide
