"""Advice behind the window, without a window: a frame at a time, interrupted, and taken as the settings shown."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import pytest

from app.panel.model import Look, Request, Shown
from app.settings import put
from app.window import advisor
from app.window.requests import Requests
from app.window.stage import Stage
from app.window.state import State

SIZE = (64, 36)
WALLS = "".join(
    f"v {x} -1 {z}\nv {x + 2} -1 {z}\nv {x + 2} 1 {z}\nv {x} 1 {z}\nf {i} {i + 1} {i + 2}\nf {i} {i + 2} {i + 3}\n"
    for i, (x, z) in ((1, (-2.0, -1.5)), (5, (-0.5, -4.0)))
)


@pytest.fixture
def rig(ctx: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[State, Requests]]:
    monkeypatch.setattr(advisor, "SPP", 32)
    monkeypatch.setattr(advisor, "has_flip", lambda: False)
    (tmp_path / "walls.obj").write_text(WALLS)
    stage = Stage(ctx, lambda text, fraction: None)
    state = State(Look(view="sharp"), Shown())
    made = Requests(state, stage, tmp_path)
    made.load(str(tmp_path / "walls.obj"))
    stage.draw(state.look, state.camera, SIZE)
    yield state, made
    made.advisor.stop()
    stage.release()


def finish(state: State, requests: Requests) -> list[str]:
    told = []
    while requests.advisor.advance():
        told.append(state.shown.advice)
    return told


def test_what_is_found_is_shown_and_other_settings_stay_as_they_are_by_then(
    rig: tuple[State, Requests], monkeypatch: pytest.MonkeyPatch
) -> None:
    state, requests = rig
    monkeypatch.setattr(advisor, "LIMIT", 2)
    monkeypatch.setattr(advisor, "VIEWS", ("traced",))
    requests.serve(Request("advise", "ms", number=1e5))
    assert state.shown.advising
    state.look = replace(state.look, settings=put(state.look.settings, "shading.exposure", 1.0))
    told = finish(state, requests)
    assert not state.shown.advising
    assert any("reference" in text for text in told)
    assert any("at most" in text for text in told)
    assert state.look.view == "traced"
    assert state.look.settings.rays.samples_per_frame == 2  # two were allowed
    assert state.look.settings.shading.exposure == 1.0
    assert state.shown.advice.startswith("traced, rays.samples_per_frame 2: error ")


def test_an_error_below_the_floor_is_a_sentence_and_changes_nothing(rig: tuple[State, Requests]) -> None:
    state, requests = rig
    before = state.look
    requests.serve(Request("advise", "error", number=1e-9))
    finish(state, requests)
    assert "noise floor" in state.shown.advice
    assert state.look == before
    assert not state.shown.advising


@pytest.mark.parametrize("frames", [3, 40])
def test_it_can_be_stopped_anywhere_and_ends_with_its_scene(rig: tuple[State, Requests], frames: int) -> None:
    state, requests = rig
    for request in (Request("stop advice"), Request("load", requests._stage.name)):
        requests.serve(Request("advise", "ms", number=1e5))
        for _ in range(frames):
            assert requests.advisor.advance()
        requests.serve(request)
        assert (state.shown.advising, state.shown.advice) == (False, "")
        assert not requests.advisor.advance()
        requests._stage.draw(state.look, state.camera, SIZE)


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan"), float("inf")])
def test_a_limit_that_is_none_is_told(rig: tuple[State, Requests], limit: float) -> None:
    state, requests = rig
    requests.serve(Request("advise", "ms", number=limit))
    assert "above 0" in state.shown.message
    assert not state.shown.advising
