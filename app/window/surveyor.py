"""When the window measures: only what is looked at, only while it stands still, and in turns with the picture."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import moderngl

from ..errors import UserError
from ..gpu.context import is_software
from ..measure.subject import Subject, survey_size
from ..measure.survey import Findings, Survey
from ..panel.model import HeatShown, SurveyShown
from ..renderer import Renderer
from .heat import Heat
from .stage import Side, Stage
from .state import State

Size = tuple[int, int]

UI_S = 0.1  # between two drawings of the panel while nothing else happens: the window should measure
STILL_S = 0.3  # without input before the first slice: the panel answers at once, and flying is never held up
WIDTH, WIDTH_SOFTWARE = 320, 160  # px of the survey's picture, of which errors and times are
SHARE = 3.0  # time for slices over time for a picture that only gets a little smoother
SLICES_MS = 8.0  # short slices are drawn until so much has passed: half a frame of a 60 Hz display


class Surveyor:
    """Owns the survey, its renderer and the heat map. Made at the first wish for either; costs nothing before."""

    def __init__(self, state: State, stage: Stage) -> None:
        self._state, self._stage = state, stage
        self._renderer: Renderer | None = None
        self._survey: Survey | None = None
        self._heat: Heat | None = None
        self._edition = -1
        self._still_key: object = None
        self._spent_s = self._picture_s = 0.0  # on slices and on the picture, since both have had work to do
        software = is_software(stage.ctx)
        wish = replace(state.look.survey, width=WIDTH_SOFTWARE if software else WIDTH)
        state.look = replace(state.look, survey=wish)

    def turn(self, size: Size, now: float, converging: bool) -> bool:
        """Draw a slice if there is one to draw, and if it is not the turn of a picture that converges: the two share
        the time.
        """
        measures = self._aim(size, now) and (self._spent_s <= SHARE * self._picture_s or not converging)
        if measures:
            self._work()
        return measures

    def drawn(self, seconds: float) -> None:
        """The stage drew a frame in that time."""
        self._picture_s += seconds

    def texture(self, side: Side) -> moderngl.Texture | None:
        """What the window shows of a side: its picture, or where that is wrong."""
        wrong = self._heat and self._state.look.heat and side is self._stage.sides[0]
        return (self._heat.texture(side, self._state.look.settings) if self._heat and wrong else None) or side.texture

    def shown(self) -> tuple[SurveyShown | None, HeatShown | None]:
        """What the panel tells; None of what was not asked for."""
        look = self._state.look
        sides = self._stage.sides
        heat = self._heat.shown(sides[0] if sides else None, look.settings) if self._heat and look.heat else None
        if not look.survey.open:
            return None, heat
        moving = self._state.pilot.active or (self._stage.moves and self._state.playing)
        findings = self._survey.findings() if self._survey else Findings()
        return SurveyShown(findings, moving, self._state.playing and self._stage.moves), heat

    def log_entry(self, places: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
        """What the status log holds of it; `places` are the plot's marks on the window."""
        survey, heat = self.shown()
        return {
            "survey": survey and {"doing": survey.findings.doing, "measured": survey.findings.measured},
            "marks": {label: [round(x), round(y)] for label, (x, y) in places.items()},
            "heat": bool(heat and heat.ready),
        }

    @property
    def memory(self) -> dict[str, int]:
        """GPU bytes of the survey's own targets."""
        kept = self._renderer.memory.items() if self._renderer else ()
        total = sum(size for name, size in kept if not name.startswith("scene: "))
        return {"survey": total} if total else {}

    def release(self) -> None:
        if self._heat:
            self._heat.release()
        if self._renderer:
            self._renderer.release()

    def _aim(self, size: Size, now: float) -> bool:
        """Take note of what is on screen; returns whether there is a slice to draw."""
        state, look = self._state, self._state.look
        moving = state.pilot.active or (self._stage.moves and state.playing)
        key = (state.camera, look, size, state.time_s)
        if key != self._still_key or moving:
            self._still_key = key
            self._spent_s = self._picture_s = 0.0
        if moving or now - state.last_input < STILL_S or not self._stage.sides:
            return False
        if look.survey.open and look.panel:
            self._aim_survey(size)
        if look.heat:
            self._heat = self._heat or Heat(self._stage)
            self._heat.aim(state.camera, look.settings, size, state.time_s)
        return self._busy and not self._stage.building

    def _work(self) -> None:
        """Draw a slice, or several short ones."""
        begin = time.perf_counter()
        try:
            self._slices(begin)
        except UserError as error:  # of a view that this scene or device cannot have
            look = self._state.look
            self._state.look = replace(look, heat=False, survey=replace(look.survey, open=False))
            self._state.say(f"not measured: {error}")
        self._spent_s += time.perf_counter() - begin

    def _slices(self, begin: float) -> None:
        while self._busy:
            if self._heat and self._truth_due:
                self._heat.step()
            elif self._survey:
                self._survey.step()
            if (time.perf_counter() - begin) * 1e3 >= SLICES_MS or self._stage.held_up:
                break

    @property
    def _busy(self) -> bool:
        look = self._state.look
        surveying = self._survey is not None and look.survey.open and look.panel and not self._survey.done
        return surveying or self._truth_due

    @property
    def _truth_due(self) -> bool:
        return self._heat is not None and self._state.look.heat and self._heat.busy

    def _aim_survey(self, size: Size) -> None:
        state, look, stage = self._state, self._state.look, self._stage
        small = survey_size(size, look.survey.width)
        if self._renderer is None or self._survey is None:
            self._renderer = stage.renderer(small)
            self._survey = Survey(stage.ctx, self._renderer)
            self._edition = stage.edition
        if self._edition != stage.edition:
            self._edition, self._renderer.scene = stage.edition, stage.gpu_scene  # type: ignore[assignment]
            self._renderer.reset()
        picture = stage.gpu_scene, stage.edition, state.camera, state.time_s, look.view, look.settings
        subject = Subject(*picture, small, look.survey.dear, look.survey.flip)
        self._survey.aim(subject)
