"""Advice: the cheapest settings whose error stays below a limit, or the most accurate within some milliseconds.

A search (search.py) over the knobs of every view, then a promise: what it found is measured again, with another seed
and more frames. Of the two errors the worse must be below the limit, of the fresh times the upper end of the median's
confidence interval; else the next best is tried. All pictures stand still.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Generator, Sequence
from dataclasses import dataclass
from typing import Any

from ..camera import Moment
from ..errors import UserError
from ..gpu.context import Context
from ..knob import qualities
from ..renderer import Renderer
from ..settings import Settings, put, walk
from .candidates import RAYS, RINGS, SAMPLES, Candidate, candidates, with_budget
from .goal import Figures, Goal, worse
from .search import GIVE_UP, Search, to_verify
from .trial import Judge, Trial

VIEWS = ("sharp", "post", "hybrid", "traced")
# Which knobs a view has, by how their names begin.
KNOBS = {
    "sharp": (),
    "post": ("post.",),
    "hybrid": ("post.", "mask.", "rays.budget", "reconstruct."),
    "traced": ("rays.samples_per_frame",),
}
FRAMES = 16  # until a picture is judged
LIMIT = 48  # candidates measured, unless told otherwise
SEED, FRESH_SEED = 0, 1  # the first is that of `shot`; a reference has its own (reference.SEEDS)
WARM_UP, TIMED = 2, 8  # frames of the search; 6 are the fewest that give an interval
FRESH_WARM_UP, FRESH_TIMED = 8, 32  # of the promise
MOST_VERIFIED = 6  # candidates; timing that jumps about more than that supports no promise


@dataclass(frozen=True)
class Progress:
    """After each frame, and with `figures` after each candidate."""

    stage: str  # "search" or "verify"
    candidate: Candidate
    done: int  # candidates measured in this stage
    most: int  # candidates at most
    left_s: float  # seconds until all are done, at most; NaN: not yet known
    figures: Figures | None = None
    kept: bool = False  # whether they keep the limit


@dataclass(frozen=True)
class Advice:
    """What came of it."""

    candidate: Candidate
    figures: Figures  # with the fresh times and the worse error; unverified if nothing kept the limit in the search
    kept: bool  # the promise; if not, this is the closest
    measured: int  # candidates


class Tuning:
    """One piece of advice, a frame at a time: `run` yields its progress and returns the advice."""

    def __init__(
        self,
        ctx: Context,
        renderer: Renderer,
        moment: Moment,
        settings: Settings,
        judge: Judge,
        *,
        error: float | None = None,
        ms: float | None = None,
        frames: int = FRAMES,
        fixed: Collection[str] = (),
        views: Sequence[str] = VIEWS,
        limit: int = LIMIT,
    ) -> None:
        """One of `error` and `ms` is given; the settings named in `fixed` stay as they are. Raises UserError."""
        if (error is None) == (ms is None):
            raise UserError("give either --error or --ms: one is kept, the other made as small as possible")
        judge.check()
        check_views(views)
        self.goal = Goal(math.nan if error is None else error, math.nan if ms is None else ms, judge.floor)
        if self.goal.of_error and not self.goal.error > self.goal.floor:
            raise UserError(
                f"--error {error:g} is not above {self.goal.floor:.4g}, the noise floor of the reference "
                f"({judge.metric}, {judge.region}): raise --error, or --spp for a better reference"
            )
        self._trial = Trial(ctx, renderer, moment, judge, frames)
        self._settings, self._fixed = settings, fixed
        knobs = {view: self._knobs(view) for view in views}
        coarse = [c for c in self._coarse() if c.view in views]
        first = [(view, settings) for view in views]
        self.search = Search(self.goal, first, coarse, knobs, limit, self._varied)
        self._spent: list[float] = []  # s, of each candidate

    def run(self) -> Generator[Progress, None, Advice]:
        """Search, then verify. Nothing else may be drawn with the renderer meanwhile."""
        yield from self._find()
        found = self.search.measured
        verified: dict[tuple[str, Settings], Figures] = {}
        while len(verified) < MOST_VERIFIED and (key := to_verify(self.goal, found, verified, self.search.cheaper)):
            candidate = self.search.candidate(key)
            fresh = yield from self._measured(
                candidate, "verify", len(verified), MOST_VERIFIED, FRESH_SEED, FRESH_WARM_UP, FRESH_TIMED
            )
            error = worse((fresh, found[key])).error
            verified[key] = Figures(fresh.ms, fresh.high_ms, error)
            kept = self.goal.kept(verified[key])
            yield Progress("verify", candidate, len(verified), MOST_VERIFIED, math.nan, verified[key], kept)
            if kept:
                return Advice(candidate, self._quoted(verified[key]), True, len(found))
        known = {**found, **verified}
        if verified:  # what seemed to keep the limit does not
            known = {key: f for key, f in known.items() if key in verified or not self.goal.kept(f)}
        closest = min(known, key=lambda key: self.goal.limited(known[key]))
        return Advice(self.search.candidate(closest), self._quoted(known[closest]), False, len(found))

    def _find(self) -> Generator[Progress, None, None]:
        search = self.search
        asks = search.run()
        try:
            candidate = next(asks)
            while True:
                figures = yield from self._measured(
                    candidate,
                    "search",
                    len(search.measured),
                    search.limit,
                    SEED,
                    WARM_UP,
                    TIMED,
                    GIVE_UP * search.useful_ms,
                )
                done = len(search.measured) + 1
                left_s = self._left_s(search.limit - done)
                kept = self.goal.kept(figures)
                yield Progress("search", candidate, done, search.limit, left_s, self._quoted(figures), kept)
                candidate = asks.send(figures)
        except StopIteration:
            return

    def _measured(
        self,
        candidate: Candidate,
        stage: str,
        done: int,
        most: int,
        seed: int,
        warm_up: int,
        timed: int,
        give_up_ms: float = math.inf,
    ) -> Generator[Progress, None, Figures]:
        begin = time.perf_counter()
        steps = self._trial.run(candidate, seed, warm_up, timed, give_up_ms)
        try:
            while True:
                next(steps)
                yield Progress(stage, candidate, done, most, self._left_s(most - done))
        except StopIteration as end:
            self._spent.append(time.perf_counter() - begin)
            return end.value  # type: ignore[no-any-return]
        finally:
            steps.close()  # now, not when it is collected: the renderer may go next

    def _left_s(self, candidates_left: int) -> float:
        return candidates_left * sum(self._spent) / len(self._spent) if self._spent else math.nan

    def _quoted(self, figures: Figures) -> Figures:
        """No error is quoted below the floor."""
        return Figures(figures.ms, figures.high_ms, self.goal.error_of(figures))

    def _knobs(self, view: str) -> dict[str, tuple[Any, ...]]:
        return {
            path: values
            for path, values in qualities(self._settings)
            if path.startswith(KNOBS[view]) and path not in self._fixed  # of () nothing starts with
        }

    def _coarse(self) -> list[Candidate]:
        """The candidates that all measurements share, with what is fixed as it is; each once."""
        made = candidates(
            self._settings,
            (self._settings.post.rings,) if "post.rings" in self._fixed else RINGS,
            (self._settings.rays.budget,) if "rays.budget" in self._fixed else RAYS,
            (self._settings.rays.samples_per_frame,) if "rays.samples_per_frame" in self._fixed else SAMPLES,
        )
        return [Candidate(c.label, c.view, self._kept_fixed(c.settings)) for c in made]

    def _varied(self, settings: Settings, path: str, value: Any) -> Settings:
        if path == "rays.budget":
            most = put(settings, "rays.max_per_pixel", self._settings.rays.max_per_pixel)
            return self._kept_fixed(with_budget(most, value))
        return put(settings, path, value)  # type: ignore[no-any-return]

    def _kept_fixed(self, settings: Settings) -> Settings:
        most = self._settings.rays.max_per_pixel
        return put(settings, "rays.max_per_pixel", most) if "rays.max_per_pixel" in self._fixed else settings


def check_views(views: Sequence[str]) -> None:
    """Raise UserError unless these are views that can be advised."""
    for view in views:
        if view not in VIEWS:
            raise UserError(f"--views {view}: choose of {', '.join(VIEWS)}")


def preset_values(candidate: Candidate, given: dict[str, Any]) -> dict[str, Any]:
    """The settings a preset of the advice holds: what was given, and every knob of its view, at its default too."""
    own = {p for p, _ in qualities(candidate.settings) if p.startswith(KNOBS[candidate.view])}
    own |= {"rays.max_per_pixel"} if candidate.view == "hybrid" else set()
    return {path: value for path, _, value in walk(candidate.settings) if path in own or path in given}
