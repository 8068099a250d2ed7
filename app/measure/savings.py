"""What a frame costs pass by pass, and what the passes that were left out would cost: the frame as planned against the
same one with every effect on.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..camera import Moment
from ..gpu.context import Context
from ..renderer import Renderer
from ..settings import Settings, opened

ROUNDS = 3  # the two frames are timed in turn: what else the machine does then meets both
WARM_UP = 2  # frames of a round that are not timed: a plan's first allocates its targets
FRAMES = 8  # of a round


@dataclass(frozen=True)
class PassCost:
    """One pass. Times are medians."""

    name: str
    reason: str  # why it runs, or why not
    ms: float | None  # None: it does not run
    full_ms: float | None  # with every effect on; None: it does not run then, either

    @property
    def saved_ms(self) -> float:
        """By leaving it out, or by a program that does less."""
        return (self.full_ms or 0.0) - (self.ms or 0.0)


@dataclass(frozen=True)
class Costs:
    """All passes of a frame, in the order of the pipeline."""

    passes: tuple[PassCost, ...]

    @property
    def ms(self) -> float:
        """The frame, as the sum of its passes."""
        return sum(cost.ms or 0.0 for cost in self.passes)

    @property
    def full_ms(self) -> float:
        """The same with every effect on."""
        return sum(cost.full_ms or 0.0 for cost in self.passes)


def measuring(
    ctx: Context, renderer: Renderer, view: str, moment: Moment, settings: Settings, rounds: int = ROUNDS
) -> Generator[float, None, Costs]:
    """Draw and time both frames of a still picture; a pinhole has the default lens in the full one.

    Yields the part that is done after each frame. Nothing else may be drawn with the renderer until it returns, and
    then it is as before.
    """
    profiler, before = renderer.profiler, (renderer.profiler.enabled, renderer.every_effect)
    times: dict[bool, dict[str, list[float]]] = {False: {}, True: {}}
    reasons: dict[str, str] = {}
    turns = [every_effect for _ in range(rounds) for every_effect in (True, False)]
    try:
        profiler.enabled = True
        for turn, every_effect in enumerate(turns):
            renderer.every_effect = every_effect
            renderer.reset()
            looks = opened(settings) if every_effect else settings
            for frame in range(WARM_UP + FRAMES):
                while not renderer.ready(view, moment.camera, looks, time_s=moment.time_s):
                    yield turn / len(turns)
                if frame == WARM_UP:
                    profiler.keep()
                ctx.finish()  # what else was drawn since the last frame, such as a window
                renderer.draw(view, moment.camera, looks, time_s=moment.time_s)
                yield (turn + frame / (WARM_UP + FRAMES)) / len(turns)
            profiler.flush()
            for name, series in profiler.samples_ms().items():
                times[every_effect].setdefault(name, []).extend(series)
            assert renderer.plan is not None
            reasons = renderer.plan.reasons
    finally:
        profiler.enabled, renderer.every_effect = before
        profiler.keep()
        renderer.reset()
    now, full = ({name: float(np.median(s)) for name, s in times[key].items()} for key in (False, True))
    order = dict.fromkeys((*full, *now, *reasons))
    return Costs(tuple(PassCost(name, reasons[name], now.get(name), full.get(name)) for name in order))
