"""The programs within one step of a frame, told apart as the cache tells them apart. Needs no GPU."""

from __future__ import annotations

from collections.abc import Mapping

from ..frame.permutations import within_one_step
from ..frame.pipeline import frame_plan
from ..frame.records import Permutation
from ..scene.facts import Facts
from ..settings import Settings
from .shaders import Key, canonical


def of_frame(view: str, settings: Settings, facts: Facts, files: Mapping[str, str]) -> frozenset[Key]:
    """The programs of one frame. Raises UserError for a view that nothing draws here."""
    return _keys({call.program for call in frame_plan(view, settings, facts).parts}, files)


def reachable(view: str, settings: Settings, facts: Facts, files: Mapping[str, str]) -> frozenset[Key]:
    """The programs of all frames that are at most one step away."""
    return _keys({call.program for call in within_one_step(view, settings, facts)}, files)


def _keys(programs: set[Permutation], files: Mapping[str, str]) -> frozenset[Key]:
    return frozenset(canonical((name, tuple(sorted(defines)), outputs), files) for name, defines, outputs in programs)
