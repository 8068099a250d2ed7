"""What shows only over time: trails after a motion has stopped, and flicker while nothing moves.

Both are read off the displayed 8-bit pictures, in units of 1/255.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from app.camera import Moment
from app.settings import Settings

from .stage import Stage

LEVELS = 2.0  # of 255: a difference that nobody sees
QUANTILE = 0.99  # of the pixels
AGE = 16  # frames after which a view that never moved counts as settled
WATCHED = 2 * AGE  # frames after the stop
CONVERGED = 4 * AGE  # frames of the picture that all settle on: its own noise is half of a settled view's
TRAIL_FRAME = 3  # at which the share of pixels that trail is counted
STEADY_AFTER, FLICKER_FRAMES = 32, 16
SEED, OTHER_SEED = 0, 1  # of what is watched, and of what it settles on: they must not share their noise

Moments = list[Moment]


@dataclass(frozen=True)
class Settling:
    """How a picture comes to rest, beside the same view drawn afresh: what that takes is noise, more than that is
    trails.
    """

    allowed: float  # levels: LEVELS, or what QUANTILE of the fresh view's pixels are within after AGE frames, if more
    frames: int | None  # after the stop until that share of the pixels is within it for good; None: not while watched
    fresh_frames: int  # the same of the fresh view, AGE at most
    trail: float  # share of pixels off by more than LEVELS in frame TRAIL_FRAME after the stop
    fresh_trail: float  # the same of the fresh view in its frame TRAIL_FRAME


def settling(
    stage: Stage, view: str, size: tuple[int, int], path: Moments, settings: Settings | None = None
) -> Settling:
    """What happens when the motion stops at the last moment of `path`."""
    rest = path[-1:]
    *_, converged = pictures(stage, view, size, rest * CONVERGED, OTHER_SEED, settings)
    fresh = [levels(p, converged) for p in pictures(stage, view, size, rest * AGE, SEED, settings)]
    drawn = pictures(stage, view, size, path + rest * WATCHED, SEED, settings)
    moved = [levels(p, converged) for p in islice(drawn, len(path), None)]
    allowed = max(LEVELS, float(np.quantile(fresh[-1], QUANTILE)))
    trail, fresh_trail = (float((series[TRAIL_FRAME - 1] > LEVELS).mean()) for series in (moved, fresh))
    fresh_frames = settled_after(fresh, allowed)
    assert fresh_frames is not None
    return Settling(allowed, settled_after(moved, allowed), fresh_frames, trail, fresh_trail)


def settled_after(differences: list[np.ndarray], allowed: float) -> int | None:
    """Number of the first frame from which on QUANTILE of the pixels stay within `allowed`; None: there is none."""
    outside = [n for n, d in enumerate(differences, 1) if np.quantile(d, QUANTILE) > allowed]
    first = max(outside, default=0) + 1
    return first if first <= len(differences) else None


def flicker(stage: Stage, view: str, size: tuple[int, int], still: Moment, settings: Settings | None = None) -> float:
    """Standard deviation over FLICKER_FRAMES frames of a view that has stood still, at QUANTILE of the pixels, in
    levels.
    """
    drawn = pictures(stage, view, size, [still] * (STEADY_AFTER + FLICKER_FRAMES), SEED, settings)
    series = np.stack(list(islice(drawn, STEADY_AFTER, None))).astype(np.float64)
    return float(np.quantile(series.std(0).max(-1), QUANTILE))


def levels(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Largest difference of the channels at each pixel (h, w) of two pictures (h, w, 3) uint8."""
    return np.abs(a.astype(int) - b.astype(int)).max(-1)


def pictures(
    stage: Stage, view: str, size: tuple[int, int], moments: Moments, seed: int, settings: Settings | None
) -> Iterator[np.ndarray]:
    """Each frame as displayed (h, w, 3) uint8, after a fresh start."""
    for renderer in stage.frames(view, size, moments, seed=seed, settings=settings):
        yield renderer.picture()
