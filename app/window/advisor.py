"""Advice while the window goes on: a search for settings, one frame of it between two frames of the window."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

from ..camera import Moment
from ..errors import UserError
from ..measure.metrics import has_flip
from ..measure.reference import drawing
from ..measure.trial import Judge
from ..measure.tune import LIMIT, VIEWS, Advice, Progress, Tuning, preset_values
from ..renderer import Renderer
from ..settings import put
from .stage import Stage
from .state import State

SPP = 256  # lens points of the reference


class Advisor:
    """One search at a time, with a renderer of its own on the scene that the window shows."""

    def __init__(self, state: State, stage: Stage) -> None:
        self._state, self._stage = state, stage
        self._renderer: Renderer | None = None
        self._steps: Generator[str, None, None] | None = None

    def start(self, goal: str, limit: float) -> None:
        """Look for settings that keep the `limit` of "error" or "ms" for what is on screen. Raises UserError."""
        self.stop()
        if not limit > 0.0 or math.isinf(limit):
            raise UserError(f"{goal} {limit:g}: give a number above 0")
        if not self._stage.sides:
            raise UserError("there is no picture yet to advise on")
        self._renderer = self._stage.renderer(self._stage.sides[0].renderer.size)
        self._steps = self._run(self._renderer, goal, limit)
        self._tell("drawing the reference")

    def stop(self) -> None:
        """End the search, if there is one, and free what it holds."""
        if self._steps:
            self._steps.close()
            self._steps = None
            self._state.shown = replace(self._state.shown, advice="")
        if self._renderer:
            self._renderer.release()
            self._renderer = None
        self._state.shown = replace(self._state.shown, advising=False)

    def advance(self) -> bool:
        """Draw one frame of the search; False where there is none."""
        if self._steps is None:
            return False
        try:
            self._tell(next(self._steps))
        except StopIteration:
            self._steps = None
            self.stop()
        except UserError as error:
            self.stop()
            self._state.shown = replace(self._state.shown, advice=str(error))
            self._state.say(str(error))
        return True

    def _run(self, renderer: Renderer, goal: str, limit: float) -> Generator[str, None, None]:
        """Yields what to tell after each frame."""
        state, ctx = self._state, self._stage.ctx
        moment, settings = Moment(state.camera, state.time_s), state.look.settings
        reference = drawing(renderer, moment.camera, settings, SPP, time_s=moment.time_s)
        try:
            while True:
                yield f"drawing the reference: {100.0 * next(reference):.0f} %"
        except StopIteration as end:
            judge = Judge(end.value, "flip" if has_flip() else "rmse")
        finally:
            reference.close()
        error, ms = (limit, None) if goal == "error" else (None, limit)
        tuning = Tuning(ctx, renderer, moment, settings, judge, error=error, ms=ms, views=VIEWS, limit=LIMIT)
        steps = tuning.run()
        try:
            while True:
                yield _told(next(steps))
        except StopIteration as end:
            self._take(end.value, goal, limit)
        finally:
            steps.close()

    def _take(self, advice: Advice, goal: str, limit: float) -> None:
        """Show the view and the settings that were found; the others stay as the user has them by now."""
        state, figures = self._state, advice.figures
        text = f"{advice.candidate.label}: error {figures.error:.4g}, {figures.ms:.2f} ms"
        if not advice.kept:
            text = f"nothing keeps {goal} below {limit:g}; the closest is {text}"
        else:
            settings = state.look.settings
            for path, value in preset_values(advice.candidate, {}).items():
                settings = put(settings, path, value)
            state.look = replace(state.look, settings=settings, view=advice.candidate.view)
        state.shown = replace(state.shown, advice=text)
        state.say(text)

    def _tell(self, text: str) -> None:
        self._state.shown = replace(self._state.shown, advising=True, advice=text)


def _told(progress: Progress) -> str:
    left = "" if math.isnan(progress.left_s) else f", at most {progress.left_s:.0f} s left"
    return f"{progress.stage}: {progress.done} of at most {progress.most} candidates{left}\n{progress.candidate.label}"
