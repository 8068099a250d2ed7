"""When the window measures, with a stage and a survey that only count: no display, no GPU."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from app.camera import Camera
from app.errors import UserError
from app.measure.survey import Findings
from app.panel.model import Look, Shown, SurveyWish
from app.window import surveyor as module
from app.window.state import State
from app.window.surveyor import SHARE, STILL_S, WIDTH_SOFTWARE, Surveyor

SIZE = (640, 360)


class FakeSurvey:
    """Ten slices of work for each subject."""

    made: list[FakeSurvey] = []  # noqa: RUF012

    def __init__(self, ctx: object, renderer: object) -> None:
        self.slices, self.left, self.subject, self.fails = 0, 0, None, False
        FakeSurvey.made.append(self)

    def aim(self, subject: Any) -> None:
        if subject != self.subject:
            self.subject, self.left = subject, 10

    def step(self) -> bool:
        if self.fails:
            raise UserError("this scene has no rays")
        self.slices, self.left = self.slices + 1, self.left - 1
        return True

    @property
    def done(self) -> bool:
        return self.left <= 0

    def findings(self) -> Findings:
        return Findings()


class Rig:
    def __init__(self) -> None:
        FakeSurvey.made.clear()
        self.renderers = 0
        self.stage: Any = SimpleNamespace(
            ctx=SimpleNamespace(info={"GL_RENDERER": "llvmpipe"}),
            building=False,
            held_up=False,
            sides=[SimpleNamespace(texture="picture")],
            moves=False,
            edition=0,
            gpu_scene="scene",
            renderer=self._renderer,
        )
        self.state = State(Look(survey=SurveyWish(open=True)), Shown())
        self.surveyor = Surveyor(self.state, self.stage)
        self.now = 1000.0

    def _renderer(self, size: tuple[int, int]) -> Any:
        self.renderers += 1
        return SimpleNamespace(release=lambda: None, memory={"scene: x": 1, "depth": 7}, reset=lambda: None)

    def turn(self, converging: bool = False) -> bool:
        self.now += 0.01
        return self.surveyor.turn(SIZE, self.now, converging)

    @property
    def survey(self) -> FakeSurvey:
        return FakeSurvey.made[0]


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    monkeypatch.setattr(module, "Survey", FakeSurvey)
    monkeypatch.setattr(module, "SLICES_MS", 0.0)  # one slice a turn
    return Rig()


def test_it_measures_what_is_on_screen_and_then_rests(rig: Rig) -> None:
    assert [rig.turn() for _ in range(12)] == [True] * 10 + [False] * 2
    subject: Any = rig.survey.subject
    assert (subject.view, subject.settings, subject.size) == ("hybrid", rig.state.look.settings, (160, 90))
    assert rig.state.look.survey.width == WIDTH_SOFTWARE
    assert rig.surveyor.memory == {"survey": 7}
    rig.state.camera = Camera(eye=(9.0, 9.0, 9.0))
    assert rig.turn()


@pytest.mark.parametrize("why", ["closed", "hidden", "flying", "playing", "touched", "no picture"])
def test_nothing_is_measured_or_made_while_nobody_looks_or_something_moves(rig: Rig, why: str) -> None:
    state = rig.state
    if why == "closed":
        state.look = replace(state.look, survey=SurveyWish(open=False))
    elif why == "hidden":
        state.look = replace(state.look, panel=False)
    elif why == "flying":
        state.pilot.press("w")
    elif why == "playing":
        rig.stage.moves = True
    elif why == "touched":
        state.last_input = rig.now - STILL_S / 2
    else:
        rig.stage.sides.clear()
    assert not any(rig.turn() for _ in range(5))
    assert FakeSurvey.made == []
    assert rig.renderers == 0


def test_a_paused_scene_is_measured(rig: Rig) -> None:
    rig.stage.moves, rig.state.playing, rig.state.time_s = True, False, 2.5
    assert rig.turn()
    assert rig.survey.subject.time_s == 2.5


def test_slices_stop_when_the_camera_flies_on(rig: Rig) -> None:
    assert rig.turn()
    rig.state.pilot.press("w")
    assert not any(rig.turn() for _ in range(5))
    assert rig.survey.slices == 1
    told, _ = rig.surveyor.shown()
    assert told is not None
    assert told.moving


def test_a_picture_that_converges_gets_its_share(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(module.time, "perf_counter", lambda: clock.now)
    step = FakeSurvey.step

    def slow(self: FakeSurvey) -> bool:
        clock.now += 0.05
        self.left = 100
        return step(self)

    monkeypatch.setattr(FakeSurvey, "step", slow)
    pictures = 0
    for _ in range(400):
        if not rig.turn(converging=True):
            pictures += 1
            rig.surveyor.drawn(0.1)
    assert rig.survey.slices + pictures == 400
    assert rig.survey.slices * 0.05 == pytest.approx(SHARE * pictures * 0.1, rel=0.1)


def test_a_failure_is_told_and_ends_it(rig: Rig) -> None:
    rig.turn()
    rig.survey.fails = True
    rig.turn()
    assert rig.state.shown.message == "not measured: this scene has no rays"
    assert not rig.state.look.survey.open
    assert not rig.turn()


def test_another_scene_or_shader_is_another_subject(rig: Rig) -> None:
    rig.turn()
    rig.stage.edition, rig.stage.gpu_scene = 1, "another"
    rig.turn()
    assert rig.survey.subject.scene == "another"
    assert rig.renderers == 1
