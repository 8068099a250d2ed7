"""Two frames timed against each other in turn, so that what else the machine does meets both.

On hardware by its timer. A software rasteriser is this process: there the CPU time of all its threads is taken, which
other programs do not add to.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import moderngl
import numpy as np

from app.gpu.context import is_software
from app.measure.timing import frame_sums
from app.settings import Settings

from .stage import Stage

ROUNDS, WARM_UP, FRAMES = 5, 2, 6
CPU_TIME = "CPU time of all threads"


@dataclass(frozen=True)
class Shot:
    """What to draw: a view of a stage."""

    stage: Stage
    view: str
    settings: Settings


def clock_name(ctx: moderngl.Context, shot: Shot) -> str:
    """What `ratio` is measured by."""
    return CPU_TIME if is_software(ctx) else shot.stage.renderer.profiler.source


def ratio(ctx: moderngl.Context, first: Shot, second: Shot) -> float:
    """Median over the rounds of the first's time over the second's."""
    return float(np.median([frames_ms(ctx, first) / frames_ms(ctx, second) for _ in range(ROUNDS)]))


def frames_ms(ctx: moderngl.Context, shot: Shot) -> float:
    """Mean ms of a still frame, in a unit of the clock's own."""
    renderer, profiler = shot.stage.renderer, shot.stage.renderer.profiler
    renderer.reset()
    profiler.enabled = not is_software(ctx)
    begin = 0.0
    for frame in range(WARM_UP + FRAMES):
        if frame == WARM_UP:
            ctx.finish()
            profiler.keep()
            begin = time.process_time()
        renderer.draw(shot.view, shot.stage.camera, shot.settings)
    ctx.finish()
    spent_ms = (time.process_time() - begin) * 1e3 / FRAMES
    if not profiler.enabled:
        return spent_ms
    profiler.flush()
    return float(np.mean(frame_sums(profiler.samples_ms())))
