"""Counts the texels that no pass should have made, target by target, while frames are drawn.

A target is checked right after the pass that wrote it, before anything else may happen to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import moderngl
import numpy as np

from ..frame.records import Call, FramePlan, Target
from ..frame.targets import TARGETS
from .programs import give
from .rehearsal import Rehearsal
from .targets import Targets
from .timing import RING

SHADER = "measure/health.comp"
GROUP = 8  # texels per side of a work group
Watched = Literal["nothing", "in turn", "all"]  # in turn: another target each frame, which costs next to nothing


@dataclass(frozen=True)
class BadTexels:
    """What was wrong in one target of one frame."""

    non_finite: int = 0  # NaN or infinite in any component
    negative: int = 0  # below zero in a component that holds no negative values, and finite

    def __bool__(self) -> bool:
        return self.non_finite > 0 or self.negative > 0


class Health:
    """Latest counts by target. Counting waits for nothing: `found` follows a few countings later."""

    def __init__(self, ctx: moderngl.Context, rehearsal: Rehearsal) -> None:
        self.watched: Watched = "nothing"
        self._due: frozenset[str] = frozenset()  # of the frame's targets
        self._frames = 0
        self._ctx, self._rehearsal = ctx, rehearsal
        self._ring: list[tuple[str, moderngl.Buffer] | None] = [None] * RING
        self._spare: list[moderngl.Buffer] = []
        self._next = 0
        self.found: dict[str, BadTexels] = {}

    def begin_frame(self, plan: FramePlan) -> None:
        """Choose what to check in a frame: nothing in one that has compiled as much as it may."""
        made = [target for call in plan.calls for target in call.writes]
        if self.found.keys() - set(made):
            self.forget()
        choice = {"nothing": [], "in turn": [made[self._frames % len(made)]], "all": made}
        due = choice[self.watched]
        self._due = frozenset(due if due and self._rehearsal.affords(SHADER) else ())
        self._frames += 1

    def after(self, call: Call, targets: Targets) -> None:
        """Queue the counting of what a pass has just made, if it is due."""
        for name in self._due.intersection(call.writes):
            self.count(TARGETS[name], targets.texture(name))

    def count(self, target: Target, texture: moderngl.Texture) -> None:
        """Queue the counting of a target's texels as they are now."""
        program = self._rehearsal.programs.get(SHADER, ()).program
        self._take(self._next)
        buffer = self._spare.pop() if self._spare else self._ctx.buffer(reserve=8)
        buffer.write(bytes(8))
        texture.use(0)
        buffer.bind_to_storage_buffer(0)
        give(program, in_target=0, unsigned_components=unsigned_components(target))
        program.run(*(math.ceil(side / GROUP) for side in texture.size))
        self._ctx.memory_barrier()
        self._ring[self._next] = target.name, buffer
        self._next = (self._next + 1) % RING

    def finish(self) -> dict[str, BadTexels]:
        """The latest counts of every target that was counted. Waits for the GPU."""
        for slot in range(self._next, self._next + RING):
            self._take(slot % RING)
        return self.found

    def forget(self) -> None:
        """Know nothing, as before the first frame."""
        self.finish()
        self.found = {}

    def release(self) -> None:
        self.forget()
        for buffer in self._spare:
            buffer.release()
        self._spare = []

    def _take(self, slot: int) -> None:
        """Read what was queued in a slot of the ring, if anything was."""
        if (queued := self._ring[slot]) is None:
            return
        name, buffer = queued
        self.found[name] = BadTexels(*map(int, np.frombuffer(buffer.read(), "<u4")))
        self._spare.append(buffer)
        self._ring[slot] = None


def unsigned_components(target: Target) -> tuple[int, int, int, int]:
    """1 for each of a target's components that is a fault if it is negative."""
    x, y, z, w = (int(i < target.components and c not in target.signed) for i, c in enumerate("xyzw"))
    return x, y, z, w
