"""One candidate drawn afresh, a frame at a time: how long its frames take, and how wrong the picture is."""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ..camera import Moment
from ..errors import UserError
from ..gpu.context import Context
from ..gpu.timing import GPU_TIMER
from ..renderer import Renderer
from .candidates import Candidate
from .goal import Figures
from .metrics import WHOLE, Array, has_flip, mean_flip, rmse
from .reference import Reference
from .timing import frame_sums, times_of

METRICS = ("flip", "rmse")
ENOUGH = 3  # timed frames after which a candidate that is far too slow is given up


def check_metric(metric: str) -> None:
    """Raise UserError unless it can be measured here."""
    if metric not in METRICS:
        raise UserError(f"--metric {metric}: choose one of {', '.join(METRICS)}")
    if metric == "flip" and not has_flip():
        raise UserError("--metric flip needs flip-evaluator: pip install 'hybrid-dof[metrics]', or use --metric rmse")


@dataclass(frozen=True)
class Judge:
    """By which figure, over which region, a picture is judged against a reference."""

    reference: Reference
    metric: str = "flip"
    region: str = WHOLE

    def check(self) -> None:
        """Raise UserError where there is nothing to judge by."""
        check_metric(self.metric)
        if self.region != WHOLE and self.region not in self.reference.regions:
            names = ", ".join((WHOLE, *self.reference.regions))
            raise UserError(f"--region {self.region}: choose one of {names}")
        if self.region != WHOLE and not self.reference.regions[self.region].any():
            raise UserError(f"--region {self.region}: no pixel of this picture belongs to it; choose another")

    def error(self, picture: Array) -> float:
        """Of linear radiance (h, w, 3), top row first."""
        region = None if self.region == WHOLE else self.reference.regions[self.region]
        if self.metric == "flip":
            return mean_flip(self.reference.picture, picture, region)
        return rmse(picture, self.reference.picture, region)

    @property
    def floor(self) -> float:
        """What a picture without any error would be said to have."""
        return self.error(np.asarray(self.reference.halves[0], np.float64))


@dataclass(frozen=True)
class Trial:
    """How candidates are drawn: `frames` still frames until the picture is judged, and so many that are timed."""

    ctx: Context
    renderer: Renderer
    moment: Moment
    judge: Judge
    frames: int

    def run(
        self, candidate: Candidate, seed: int, warm_up: int, timed: int, give_up_ms: float = math.inf
    ) -> Generator[None, None, Figures]:
        """Yields after each frame. Nothing else may be drawn with the renderer until it returns; its seed and profiler
        are then as before. Given up, with an error of NaN, when even its fastest frame is above `give_up_ms`.
        """
        renderer, total = self.renderer, max(self.frames, warm_up + timed)
        profiler = renderer.profiler
        before = renderer.seed, profiler.enabled
        by_query = profiler.source == GPU_TIMER
        wall_ms: list[float] = []
        error = math.nan
        try:
            renderer.reset()
            renderer.seed, profiler.enabled = seed, by_query
            for frame in range(total):
                if frame == warm_up:
                    profiler.keep(total - warm_up)
                    self.ctx.finish()
                camera, time_s = self.moment
                while not renderer.ready(candidate.view, camera, candidate.settings, time_s=time_s):
                    yield
                if not by_query:
                    self.ctx.finish()  # what else was drawn since the last frame, such as a window
                begin = time.perf_counter()
                renderer.draw(candidate.view, camera, candidate.settings, time_s=time_s)
                if not by_query:  # queries time frames that overlap, as they do in use
                    self.ctx.finish()
                if frame >= warm_up:
                    wall_ms.append((time.perf_counter() - begin) * 1e3)
                if frame == self.frames - 1:
                    error = self.judge.error(np.asarray(renderer.linear(), np.float64))
                yield
                if frame < self.frames and frame - warm_up + 1 >= ENOUGH:
                    so_far = frame_sums(profiler.samples_ms()) if by_query else wall_ms
                    if so_far and min(so_far) > give_up_ms:  # the fastest: other programs slow some frames down
                        break
            profiler.flush()
            series: Sequence[float] = frame_sums(profiler.samples_ms()) if by_query else wall_ms
            times = times_of(series)
            return Figures(times.median, times.high, error)
        finally:
            renderer.seed, profiler.enabled = before
            profiler.keep()
            renderer.reset()
