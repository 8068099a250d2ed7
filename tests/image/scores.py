"""What a view costs and what it gets wrong."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import moderngl
import numpy as np

from app.camera import Moment
from app.measure.metrics import WHOLE
from app.measure.reference import Reference
from app.renderer import Renderer
from app.settings import Settings

from .stage import Stage

WARM_UP = 2  # frames before anything is timed: programs are compiled and targets made
BOTH_SIDES = "near_silhouettes"  # the region of app/measure/regions.py, as the tables name it
BOTH_SIDES_MEANS = (
    "Both sides: pixels that see something nearer than the focus zone through more than 2 % and less than 98 % of the "
    "lens."
)
UNTIMED = 2  # frames left out after a fresh start, which have less to do than those that follow


@dataclass(frozen=True)
class Error:
    """Mean FLIP, 0 to 1; NaN where there is no such pixel."""

    whole: float
    both_sides: float  # where the lens sees the near field and what is behind it


@dataclass(frozen=True)
class Score:
    """A still view after some frames."""

    error: Error
    ms: float  # median of a frame
    masked: float  # share of the half-resolution pixels in the ray mask; NaN for views without one
    rays: float  # lens rays in the last frame per masked pixel; NaN likewise
    picture: np.ndarray  # (h, w, 3) uint8, as displayed


def scored(
    ctx: moderngl.Context,
    stage: Stage,
    view: str,
    size: tuple[int, int],
    frames: int,
    reference: Reference,
    settings: Settings | None = None,
) -> Score:
    """A view from the stage's camera at time 0, after `frames` frames."""
    still = Moment(stage.camera, 0.0)
    for _ in stage.frames(view, size, [still] * WARM_UP, settings=settings):
        pass
    times = [ms for _, ms in timed(ctx, stage.frames(view, size, [still] * frames, settings=settings))]
    renderer = stage.renderer
    return Score(error(renderer, reference), median_ms(times), *ray_use(renderer), renderer.picture())


def timed(ctx: moderngl.Context, frames: Iterator[Renderer]) -> Iterator[tuple[Renderer, float]]:
    """Each frame with the milliseconds it took until the GPU had finished it."""
    while True:
        ctx.finish()
        begin = time.perf_counter()
        renderer = next(frames, None)
        if renderer is None:
            return
        ctx.finish()
        yield renderer, (time.perf_counter() - begin) * 1e3


def median_ms(times: list[float]) -> float:
    """Of all frames but the first ones, if there are others."""
    return float(np.median(times[UNTIMED:] or times))


def error(renderer: Renderer, reference: Reference) -> Error:
    """Of the last frame."""
    errors = reference.errors(renderer.linear())
    return Error(errors[WHOLE].flip, errors[BOTH_SIDES].flip)


def mean_error(errors: list[Error]) -> Error:
    """Mean over frames of one size; of the region only over those that have it."""
    regions = [e.both_sides for e in errors if math.isfinite(e.both_sides)]
    return Error(float(np.mean([e.whole for e in errors])), float(np.mean(regions)) if regions else math.nan)


def ray_use(renderer: Renderer) -> tuple[float, float]:
    """(share of half-resolution pixels in the mask, rays per such pixel) of the last frame; NaN where it had none."""
    assert renderer.plan is not None
    if "mask" not in {target for call in renderer.plan.calls for target in call.writes}:
        return math.nan, math.nan
    masked = renderer.read("mask")[..., 0] > 0.0
    rays = renderer.read("ray_count")[..., 0]
    return float(masked.mean()), float(rays[masked].mean()) if masked.any() else math.nan
