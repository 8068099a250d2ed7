"""How long a view's frames take, with a figure for how sure that is.

With a GPU timer that passed its self-test (app/gpu/timing.py) a frame is the sum of its passes' GPU time. Otherwise it
is the wall clock from the call of `draw` until the GPU has finished, while nothing waits between passes; the passes are
then timed in frames of their own, since finishing each one before the next costs time. What the processor does for a
frame is measured beside it: the drawing thread's own time, waits excluded.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..camera import Camera
from ..errors import UserError
from ..gpu.context import Context, device_name
from ..gpu.timing import GPU_TIMER, WALL_CLOCK
from ..renderer import Renderer
from ..settings import Settings

CONFIDENCE = 0.95
SUM_OF_PASSES = "sum of the passes by GPU timer"


@dataclass(frozen=True)
class Times:
    """Milliseconds of something that was done many times."""

    median: float
    p95: float  # 95 % were no slower
    low: float  # the median's confidence interval (median_interval); NaN: too few times to say
    high: float
    count: int

    def differs_from(self, other: Times) -> bool:
        """Whether the medians differ by more than their noise explains: their intervals do not overlap."""
        return self.high < other.low or other.high < self.low


@dataclass(frozen=True)
class FrameTimes:
    """Of one view that stands still."""

    frame: Times
    passes: Mapping[str, Times]  # by name, in the order they run
    cpu: Times  # of the drawing thread
    frames: int  # that were timed
    warm_up: int  # frames drawn before them: programs are compiled, targets made, history filled
    source: str  # of the passes: GPU_TIMER or WALL_CLOCK of app/gpu/timing.py
    frame_source: str  # of the frame: SUM_OF_PASSES, or the wall clock
    device: str
    frame_ms: tuple[float, ...] = field(default=(), repr=False)  # each frame's, in order


def time_view(
    ctx: Context,
    renderer: Renderer,
    view: str,
    camera: Camera,
    settings: Settings,
    frames: int = 32,
    warm_up: int = 8,
    *,
    time_s: float = 0.0,
    fresh: bool = True,
    pass_frames: int | None = None,
) -> FrameTimes:
    """Time `frames` frames of a view after a fresh start (not `fresh`: as a sequel to what was drawn last) and
    `warm_up` frames. The renderer's size stays as it is.

    With the wall clock all is drawn twice, the second time for the passes, of which `pass_frames` may ask for fewer
    frames, or for none.
    """
    if frames < 1 or warm_up < 0:
        raise UserError(f"{frames} frames after {warm_up} cannot be timed; give at least 1 after 0")
    profiler = renderer.profiler
    by_query = profiler.source == GPU_TIMER
    was_enabled = profiler.enabled
    try:
        profiler.enabled = by_query
        if fresh:
            renderer.reset()
        wall_ms, cpu_ms = _series(ctx, renderer, view, camera, settings, frames, warm_up, time_s)
        again = frames if pass_frames is None else pass_frames
        if not by_query and again:
            profiler.enabled = True
            if fresh:
                renderer.reset()
            _series(ctx, renderer, view, camera, settings, again, warm_up, time_s)
        profiler.flush()
        of_passes = profiler.samples_ms()
    finally:
        profiler.keep()
        profiler.enabled = was_enabled
    frame_ms = frame_sums(of_passes) if by_query else wall_ms
    return FrameTimes(
        frame=times_of(frame_ms),
        passes={name: times_of(series) for name, series in of_passes.items()},
        cpu=times_of(cpu_ms),
        frames=frames,
        warm_up=warm_up,
        source=profiler.source,
        frame_source=SUM_OF_PASSES if by_query else WALL_CLOCK,
        device=device_name(ctx),
        frame_ms=tuple(frame_ms),
    )


def _series(
    ctx: Context,
    renderer: Renderer,
    view: str,
    camera: Camera,
    settings: Settings,
    frames: int,
    warm_up: int,
    time_s: float,
) -> tuple[list[float], list[float]]:
    """(wall-clock ms, drawing thread's ms) of each of the last `frames` frames, while the profiler keeps the same. With
    queries frames overlap on the GPU, as they do in use, and the wall clock means nothing.
    """
    overlap = renderer.profiler.enabled and renderer.profiler.source == GPU_TIMER
    wall_ms, cpu_ms = [], []
    for frame in range(warm_up + frames):
        if frame == warm_up:
            renderer.profiler.keep(frames)
            ctx.finish()
        begin = time.perf_counter()
        renderer.draw(view, camera, settings, time_s=time_s)
        if not overlap:
            ctx.finish()
        wall_ms.append((time.perf_counter() - begin) * 1e3)
        cpu_ms.append(renderer.cpu_ms)
    return wall_ms[warm_up:], cpu_ms[warm_up:]


def frame_sums(of_passes: Mapping[str, Sequence[float]]) -> list[float]:
    """Each frame's sum over its passes; counted from the last frame, should a pass have run in fewer than others."""
    frames = min((len(series) for series in of_passes.values()), default=0)
    return np.sum([series[-frames:] for series in of_passes.values()], axis=0).tolist() if frames else []


def times_of(series: Sequence[float]) -> Times:
    """Median, 95th percentile (between neighbouring samples, linear) and the median's interval; NaN of no samples."""
    if not series:
        return Times(math.nan, math.nan, math.nan, math.nan, 0)
    return Times(
        float(np.median(series)), float(np.quantile(series, 0.95)), *median_interval(series), count=len(series)
    )


def median_interval(series: Sequence[float], confidence: float = CONFIDENCE) -> tuple[float, float]:
    """An interval that holds the true median with at least this confidence, whatever the times' distribution.

    Each of n independent samples is below the true median with probability 1/2, so that the k-th smallest is above it
    with probability P(Binomial(n, 1/2) < k): the k-th smallest and k-th largest sample miss it with twice that (David
    and Nagaraja 2003, section 7.1). Less than 6 samples cannot say so much: NaN. Frames that follow each other are not
    quite independent, and no interval knows of a load that comes and goes more slowly than what was timed.
    """
    n = len(series)
    ranks = [k for k in range(1, n // 2 + 1) if _missed(n, k) <= 1.0 - confidence]
    if not ranks:
        return math.nan, math.nan
    ordered = sorted(series)
    return float(ordered[ranks[-1] - 1]), float(ordered[n - ranks[-1]])


def _missed(n: int, k: int) -> float:
    """Twice P(Binomial(n, 1/2) < k), from exact integers."""
    return 2 * sum(math.comb(n, i) for i in range(k)) / 2**n
