"""The stress scenes: what each strains. Made by code when they are asked for, not stored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ...errors import UserError
from ..decoded import Decoded
from . import bare, bright, coplanar, crowd, grazing, hedge, knife_edges, mirrors, near_lens, slivers, table, watertight

PREFIX = "stress:"


@dataclass(frozen=True)
class Stress:
    """One stress scene; its camera, focus distance and aperture have the hard case in view."""

    name: str  # with the prefix
    description: str  # what it strains
    make: Callable[[], Decoded]

    @property
    def module(self) -> Path:
        """The file that makes it: what a stored scene's own file is to that."""
        maker = self.make.func if isinstance(self.make, partial) else self.make
        return Path(maker.__code__.co_filename)


STRESS = tuple(
    Stress(PREFIX + name, description, make)
    for name, description, make in (
        ("watertight", "Shared edges and vertices: closed shells, where every hole shines", watertight.make),
        ("slivers", "Triangles of millions to one and of no area, before a bright sky", slivers.make),
        ("coplanar", "Which of two surfaces is seen: duplicates and overlaps in one plane", coplanar.make),
        ("twin", "Nothing: the scene that tiny, huge and far-away are compared with", table.make),
        ("tiny", "Offsets and thresholds in metres: the twin at a thousandth of its size", partial(table.make, 1e-3)),
        ("huge", "Depth resolution: the twin ten thousand times as large", partial(table.make, 1e4)),
        ("far-away", "Float32 coordinates: the twin, 100 km from the origin",
         partial(table.make, 1.0, (1e5, 0.0, -1e5))),
        ("bright", "Half floats and fireflies: small lamps of a million beside black", bright.make),
        ("near-lens", "The near plane and blur larger than the picture: things that touch the lens", near_lens.make),
        ("hedge", "Alpha-masked layers, 72 deep", hedge.make),
        ("crowd", "Many instances: a hundred thousand", crowd.make),
        ("empty", "No triangle at all", bare.empty),
        ("one-triangle", "A tree of one leaf, and a flat world", bare.one_triangle),
        ("grazing", "Depth and slope at the horizon of a floor, and planes edge on", grazing.make),
        ("knife-edges", "The sign of the CoC: blades exactly in focus and next to it", knife_edges.make),
        ("mirrors", "Highlights smaller than a pixel: polished metal in the sun", mirrors.make),
    )
)  # fmt: skip


def stress_scene(name: str) -> Stress | None:
    """The stress scene of that name, or None for names without the prefix. Raises UserError for an unknown one."""
    if not name.startswith(PREFIX):
        return None
    found = next((entry for entry in STRESS if entry.name == name), None)
    if found is None:
        names = ", ".join(entry.name for entry in STRESS)
        raise UserError(f"there is no stress scene {name.removeprefix(PREFIX)!r}; choose one of {names}")
    return found
