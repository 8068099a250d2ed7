"""A renderer into whose targets a test writes single texels, right after the pass that made them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.frame.records import Call
from app.frame.targets import TARGETS
from app.gpu.frame_block import FrameInputs
from app.renderer import Renderer

_NUMPY = {"f1": "u1", "f2": "<f2", "f4": "<f4"}


@dataclass(frozen=True)
class Poison:
    """One texel of a target, from the left and the bottom, and what it is overwritten with in every component."""

    target: str
    x: int
    y: int
    value: float


class PoisonedRenderer(Renderer):
    """Draws as any, except that `poison` is written where and when its target has just been made."""

    poison: Poison | None = None

    def _run(self, call: Call, inputs: FrameInputs) -> None:
        super()._run(call, inputs)
        if self.poison and self.poison.target in call.writes:
            self._ctx.memory_barrier()
            target = TARGETS[self.poison.target]
            with np.errstate(over="ignore"):
                texel = np.full(target.components, self.poison.value, _NUMPY[target.dtype])
            place = (self.poison.x, self.poison.y, 1, 1)
            self._targets.texture(self.poison.target).write(texel.tobytes(), viewport=place, alignment=1)
