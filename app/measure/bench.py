"""Accuracy against time: what is run for one scene, and what is noted of it. Everything noted is plain JSON values.

A candidate is drawn from a fresh start for so many frames, its errors read on the way; the frames that are timed follow
on, so that what was drawn is their warm-up. The traced view's samples form one running mean: its error after one frame
of S samples is that of any S samples, and one series of samples serves all candidates.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ..camera import Camera, camera_values
from ..gpu.context import Context
from ..renderer import Renderer
from ..settings import Settings, plain, put, to_dict, walk
from . import quote
from .candidates import RAYS, RINGS, SAMPLES, Candidate, candidates
from .metrics import WHOLE, Errors
from .reference import TRACE_BATCH, Progress, Reference
from .regions import REGIONS
from .timing import FrameTimes, Times, time_view

Values = dict[str, Any]

VIEWS = ("sharp", "post", "hybrid", "traced")
METRICS = tuple(quote.METRICS)
ALL_REGIONS = (WHOLE, *REGIONS)
VARIED = {"post": "post.rings", "hybrid": "rays.budget", "traced": "rays.samples_per_frame"}  # by view

SERIES_SAMPLES = 64  # of the traced view: more say little that the slope does not
ALLOWANCE_S = 6.0  # for timing one candidate's frames ...
LONGER = 3.0  # ... and so many times that where it buys an interval
FEWEST = 6  # frames that have one (timing.median_interval)
FEW = 3  # frames of a dear candidate whose passes are timed; each costs as much as a frame


@dataclass(frozen=True)
class Effort:
    """How much is run."""

    size: tuple[int, int] = (640, 360)
    frames: int = 16  # that a still picture accumulates
    timed: int = 12  # frames, at most
    spp: int = 256  # of the reference
    seed: int = 0
    time_s: float = 0.0  # at which moving scenes stand still
    views: tuple[str, ...] = VIEWS
    rings: tuple[int, ...] = RINGS
    rays: tuple[float, ...] = RAYS
    samples: tuple[int, ...] = SAMPLES

    def chosen(self, settings: Settings) -> list[Candidate]:
        """What is compared, `settings` deciding whatever is not varied."""
        made = candidates(settings, self.rings, self.rays, self.samples)
        return [candidate for candidate in made if candidate.view in self.views]


@dataclass(frozen=True)
class Stage:
    """A scene seen by one camera, ready to be measured."""

    ctx: Context
    renderer: Renderer
    camera: Camera
    settings: Settings
    truth: Reference


def scene_values(stage: Stage, effort: Effort, digest: str) -> Values:
    """What must be known of a scene to read its figures: the camera, the settings, and how true the reference is."""
    labels = stage.truth.labels
    shares = {name: float((labels == label).mean()) for label, name in enumerate(REGIONS)}
    return {
        "digest": digest,
        "camera": camera_values(stage.camera),
        "settings": to_dict(stage.settings),
        "reference": {"view": "reference", "spp": effort.spp, "notes": list(stage.truth.notes)},
        "floor": {name: _finite(asdict(errors)) for name, errors in stage.truth.floor.items()},
        "share": {WHOLE: 1.0, **shares},
    }


def measured(stage: Stage, candidate: Candidate, effort: Effort, series: Values | None) -> Values:
    """Errors and times of one candidate; `series` is `traced_series` where it is traced."""
    errors, frame_s = drawn(stage, candidate, effort) if series is None else of_series(series, candidate, effort.frames)
    times = _timed(stage, candidate, effort, frame_s, begun=series is None)
    return {
        "label": candidate.label,
        "view": candidate.view,
        "varied": varied(candidate),
        "errors": errors,
        "times": times_values(times),
    }


def varied(candidate: Candidate) -> Values:
    """{the setting that makes the candidate: its value}; empty for the sharp view."""
    path = VARIED.get(candidate.view)
    return {name: plain(value) for name, _, value in walk(candidate.settings) if name == path}


def drawn(stage: Stage, candidate: Candidate, effort: Effort) -> tuple[Values, float]:
    """({frames: {region: errors}}, seconds of a frame) of a fresh start."""
    renderer, errors, spent = _fresh(stage, effort), {}, []
    for frame in range(1, effort.frames + 1):
        begin = time.perf_counter()
        renderer.draw(candidate.view, stage.camera, candidate.settings, time_s=effort.time_s)
        stage.ctx.finish()
        spent.append(time.perf_counter() - begin)
        if frame in checkpoints(effort.frames):
            errors[str(frame)] = quoted(stage.truth, renderer)
    return errors, min(spent)  # the first frame also compiles


def traced_series(stage: Stage, effort: Effort, progress: Progress | None = None) -> Values:
    """{"errors": {samples: {region: errors}}, "sample_s": seconds} of one running mean of the traced view."""
    renderer, errors, spent, done = _fresh(stage, effort), {}, 0.0, 0
    stops = sample_stops(effort)
    for stop in stops:
        while done < stop:
            samples = min(TRACE_BATCH, stop - done)
            settings = put(stage.settings, "rays.samples_per_frame", samples)
            begin = time.perf_counter()
            renderer.draw("traced", stage.camera, settings, time_s=effort.time_s)
            stage.ctx.finish()
            if done:  # the first frame also compiles
                spent += time.perf_counter() - begin
            done += samples
            if progress:
                progress("traced series", done / stops[-1])
        errors[str(done)] = quoted(stage.truth, renderer)
    return {"errors": errors, "sample_s": spent / max(done - 1, 1)}


def sample_stops(effort: Effort) -> list[int]:
    """After how many samples the series' errors are read: all that some candidate has after some frames."""
    stops = {samples * frames for samples in effort.samples for frames in checkpoints(effort.frames)}
    return sorted(stop for stop in stops if stop <= SERIES_SAMPLES)


def of_series(series: Values, candidate: Candidate, frames: int) -> tuple[Values, float]:
    """What `drawn` says, read off the series, as far as it goes."""
    samples = candidate.settings.rays.samples_per_frame
    after = {frame: series["errors"].get(str(samples * frame)) for frame in checkpoints(frames)}
    return {str(frame): errors for frame, errors in after.items() if errors}, samples * series["sample_s"]


def checkpoints(frames: int) -> list[int]:
    """1, 2, 4, ... and `frames`: where errors are read."""
    return sorted({1 << n for n in range(frames.bit_length())} | {frames})


def quoted(truth: Reference, renderer: Renderer) -> Values:
    """The errors of what was drawn last, by region; nothing better than the reference's floor, which is named then."""
    errors = truth.errors(renderer.linear())
    return {name: not_below(errors[name], truth.floor[name]) for name in errors}


def not_below(errors: Errors, floor: Errors) -> Values:
    """Errors of which none is better than the floor, and which are at it: smaller ones mean nothing."""
    values, at_floor = asdict(errors), []
    for name in METRICS:
        figure, reached = quote.quoted(errors, floor, name)
        if reached and 0.0 < figure < math.inf:  # a reference without noise has no floor
            values[name] = figure
            at_floor.append(name)
    return {**_finite(values), "at_floor": at_floor}


def frames_to_time(frame_s: float, timed: int) -> int:
    """How many frames are timed: few of the dear ones, but enough for an interval where that costs not much more."""
    affordable = int(ALLOWANCE_S / max(frame_s, 1e-6))
    if FEWEST * frame_s <= LONGER * ALLOWANCE_S:
        affordable = max(affordable, FEWEST)
    return max(1, min(timed, affordable))


def _timed(stage: Stage, candidate: Candidate, effort: Effort, frame_s: float, *, begun: bool) -> FrameTimes:
    warm_up = effort.frames
    if not begun:  # nothing of it was drawn: a frame of one sample readies programs and targets
        renderer, warm_up = _fresh(stage, effort), 1
        one = put(candidate.settings, "rays.samples_per_frame", 1)
        renderer.draw(candidate.view, stage.camera, one, time_s=effort.time_s)
    count = frames_to_time(frame_s, effort.timed)
    times = time_view(
        stage.ctx,
        stage.renderer,
        candidate.view,
        stage.camera,
        candidate.settings,
        count,
        0,
        time_s=effort.time_s,
        fresh=False,
        pass_frames=min(FEW, count) if count >= FEWEST else 0,
    )
    stage.renderer.reset()
    return replace(times, warm_up=warm_up)


def _fresh(stage: Stage, effort: Effort) -> Renderer:
    stage.renderer.reset()
    stage.renderer.seed = effort.seed
    stage.renderer.profiler.enabled = False
    return stage.renderer


def times_values(times: FrameTimes) -> Values:
    """As JSON."""
    return {
        "frame": _finite(asdict(times.frame)),
        "cpu": _finite(asdict(times.cpu)),
        "passes": {name: _finite(asdict(of_pass)) for name, of_pass in times.passes.items()},
        "frames": times.frames,
        "warm_up": times.warm_up,
        "source": times.source,
        "frame_source": times.frame_source,
        "frame_ms": list(times.frame_ms),
    }


def times_of_values(values: Values) -> Times:
    """Times as they were before they became JSON."""
    median, p95, low, high = (_number(values[name]) for name in ("median", "p95", "low", "high"))
    return Times(median, p95, low, high, values["count"])


def error(run: Values, frames: int, metric: str, region: str = WHOLE) -> float:
    """One figure of a run; NaN where it is not known."""
    return _number(run["errors"].get(str(frames), {}).get(region, {}).get(metric))


def last_frames(run: Values) -> int:
    """The most frames after which a run's errors are known."""
    return max(map(int, run["errors"]))


def metric_of(runs: Iterable[Values]) -> str:
    """What tables and plots rank by: FLIP where it was measured."""
    return "flip" if any(error(run, 1, "flip") == error(run, 1, "flip") for run in runs) else "rmse"


def post_of(runs: Sequence[Values], rings: int) -> Values | None:
    """The post-process that the others are compared with: with so many rings if it was run, or the first."""
    of_post = [run for run in runs if run["view"] == "post"]
    return next((run for run in of_post if run["varied"]["post.rings"] == rings), of_post[0] if of_post else None)


def slug(text: str) -> str:
    """A label as a file's name."""
    return "".join(c if c.isalnum() or c in "._-" else "-" for c in text.replace(", ", "-")).strip(".-") or "scene"


def subject_name(scene: str, camera_file: str | None) -> str:
    """What a scene seen by a camera is called."""
    name = Path(scene).stem
    return f"{name}@{Path(camera_file).stem}" if camera_file else name


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _finite(values: Values) -> Values:
    """JSON knows neither NaN nor infinity: null."""
    return {name: None if isinstance(v, float) and not math.isfinite(v) else v for name, v in values.items()}
