"""From when to when a frame needs each target's value, and which values may follow one another in the same storage.

A value lives from the call that first writes it to the call that last reads it, both included: what a call reads and
what it writes never share. Values whose lives do not meet, and whose textures are alike, share a slot. Slots are given
out first come, first served, which needs no more of them than values are alive at once: lives are intervals, and the
greedy colouring of an interval graph is optimal (Golumbic 2004, *Algorithmic Graph Theory and Perfect Graphs*, ch. 8).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from .records import FramePlan, Target
from .targets import DEPTH_TEST, TARGETS

BEFORE = -1  # a life that begins there was begun by an earlier frame

# The target under a click: it is read after any frame, also after those that no longer draw it.
PICKED = "depth"

Value = tuple[str, bool]  # (target's name, whether it is the last frame's value)


class Format(NamedTuple):
    """Textures of one format and one full resolution may stand for each other."""

    scale: int
    fixed: tuple[int, int] | None
    components: int
    dtype: str


class Life(NamedTuple):
    """From the call `first` to the call `last`; BEFORE: it is there as the frame begins; the number of calls: it
    outlives the frame. Two values where this frame's is written over the last one's.
    """

    values: tuple[Value, ...]
    target: Target
    first: int
    last: int

    @property
    def format(self) -> Format:
        return format_of(self.target)

    def meets(self, other: Life) -> bool:
        """Whether there is a call that needs both."""
        return self.first <= other.last and other.first <= self.last


@dataclass(frozen=True)
class Slot:
    """One texture of a frame, and what it holds one after the other."""

    format: Format
    lives: tuple[Life, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The targets that it holds, each once."""
        return tuple(dict.fromkeys(name for life in self.lives for name, _ in life.values))


def format_of(target: Target) -> Format:
    """What a texture must have in common with another target's to hold it."""
    return Format(target.scale, target.fixed, target.components, target.dtype)


def lifetimes(plan: FramePlan, kept: Collection[str], targets: Mapping[str, Target] = TARGETS) -> tuple[Life, ...]:
    """The lives of all values of a plan, by their beginning; `kept`: targets that are read after the frame."""
    after = len(plan.calls)
    first: dict[str, int] = {}
    last: dict[str, int] = {}
    last_previous: dict[str, int] = {}
    for index, call in enumerate(plan.calls):
        for name in (*call.writes, *(target for _, target in call.reads)):
            first.setdefault(name, index)
            last[name] = index
        last_previous |= dict.fromkeys(call.step.history, index)
    updated = {name for call in plan.calls for name in call.step.updates}
    in_place = {name for call in plan.calls for name in call.in_place}
    sliced = next((index for index, call in enumerate(plan.calls) if call.step.sliced), None)
    lives = []
    for name, begin in first.items():
        end = after if name in kept or targets[name].history else last[name]
        if name in updated:
            begin, end = BEFORE, after
        elif sliced is not None and begin < sliced <= last[name]:
            begin, end = BEFORE, after  # the next slice of the frame reads it without drawing it again
        values: tuple[Value, ...] = ((name, False),)
        if name in in_place:
            values, begin = ((name, True), (name, False)), BEFORE
        elif name in last_previous:
            lives.append(Life(((name, True),), targets[name], BEFORE, last_previous[name]))
        lives.append(Life(values, targets[name], begin, end))
    unwritten = {name: after for name in last_previous if name not in first}  # it stays the last frame's
    lives += [Life(((name, True),), targets[name], BEFORE, end) for name, end in unwritten.items()]
    rasters = [index for index, call in enumerate(plan.calls) if call.step.kind == "raster"]
    if rasters:
        lives.append(Life(((DEPTH_TEST.name, False),), DEPTH_TEST, rasters[0], rasters[-1]))
    return tuple(sorted(lives, key=lambda life: life.first))


def shared_slots(lives: Collection[Life]) -> tuple[Slot, ...]:
    """The fewest slots that hold all lives: two in a slot are of one format and never meet."""
    slots: dict[Format, list[list[Life]]] = {}
    for life in sorted(lives, key=lambda life: life.first):
        alike = slots.setdefault(life.format, [])
        for slot in alike:
            if slot[-1].last < life.first:
                slot.append(life)
                break
        else:
            alike.append([life])
    return tuple(Slot(format, tuple(held)) for format, alike in slots.items() for held in alike)


def own_slots(lives: Collection[Life]) -> tuple[Slot, ...]:
    """A slot for each life: after the frame every value is still there."""
    return tuple(Slot(life.format, (life,)) for life in lives)
