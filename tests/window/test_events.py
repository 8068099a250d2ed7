"""Events without a window: ImGui is asked first, releases always arrive, a lost keyboard forgets what was held."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from imgui_bundle import imgui

from app.camera import Camera
from app.panel.input import UiInput
from app.panel.model import Look, Request, Shown, SurveyWish
from app.window.events import Events
from app.window.state import State

Rig = tuple[Events, State, "FakeDesktop"]
PICTURE_WIDTH = 400.0


class FakeDesktop:
    size = (700, 300)

    def __init__(self) -> None:
        self.captured = self.ended = False

    def capture_mouse(self, captured: bool) -> None:
        self.captured = captured

    def quit(self) -> None:
        self.ended = True


class FakePanel:
    def picture(self, size: tuple[float, float]) -> tuple[float, float, float, float]:
        return 0.0, 0.0, PICTURE_WIDTH, 300.0


class FakeStage:
    """Geometry 2 m away in the left half, sky in the right."""

    moves = True

    def depth_at(self, across: float, down: float, look: Look) -> float | None:
        return 2.0 if across < 0.5 else None


@pytest.fixture
def rig() -> Iterator[Rig]:
    imgui.create_context()
    imgui.get_io().set_ini_filename("")
    desktop, state = FakeDesktop(), State(Look(), Shown())
    parts: tuple[Any, ...] = (desktop, state, FakeStage(), FakePanel())
    yield Events(*parts, digest=lambda: None), state, desktop
    imgui.destroy_context()


def claim(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    monkeypatch.setattr(UiInput, what, property(lambda self: True))


def click(events: Events, x: float, y: float, to: tuple[float, float] | None = None) -> None:
    events.on_pointer(x, y, 0.0, 0.0)
    events.on_button("left", True)
    if to:
        events.on_pointer(*to, to[0] - x, to[1] - y)
    events.on_button("left", False)


def test_a_key_that_imgui_wants_does_nothing_here_but_function_keys_work(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    events, state, desktop = rig
    claim(monkeypatch, "wants_keyboard")
    for key in ("w", "_1", "escape", "tab", "c"):
        events.on_key(key, True)
    assert state.look == Look()
    assert not state.pilot.active
    assert not desktop.ended
    events.on_key("f1", True)
    assert state.look.help


def test_a_key_right_after_a_click_on_the_panel_counts(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """ImGui wants the keyboard until it has worked through the click's release."""
    events, state, _ = rig
    behind = [True]
    monkeypatch.setattr(UiInput, "wants_keyboard", property(lambda self: behind[0]))
    monkeypatch.setattr(events, "_digest", lambda: behind.__setitem__(0, False))
    events.on_key("h", True)
    assert state.look.heat


def test_m_opens_the_section_on_cost_wherever_the_panel_was(rig: Rig) -> None:
    events, state, _ = rig
    for panel, opened, after in ((True, False, True), (True, True, False), (False, True, True), (False, False, True)):
        state.look = Look(panel=panel, survey=SurveyWish(open=opened))
        events.on_key("m", True)
        assert state.look == Look(survey=SurveyWish(open=after))


def test_a_release_arrives_even_if_imgui_wants_the_keyboard_by_then(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    events, state, _ = rig
    events.on_key("w", True)
    state.pilot.advance(Camera(), 0.1)
    claim(monkeypatch, "wants_keyboard")
    events.on_key("w", False)
    assert not state.pilot.active


def test_a_click_that_imgui_wants_or_that_lies_on_the_panel_does_not_focus(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    events, state, _ = rig
    click(events, PICTURE_WIDTH + 50.0, 100.0)
    claim(monkeypatch, "wants_mouse")
    click(events, 100.0, 100.0)
    assert state.look == Look()


def test_a_click_focuses_a_drag_does_not_and_the_sky_is_no_target(rig: Rig) -> None:
    events, state, _ = rig
    click(events, 100.0, 100.0, to=(130.0, 100.0))
    assert state.look == Look()
    click(events, 100.0, 100.0, to=(102.0, 101.0))  # a hand trembles
    assert state.look.settings.lens.focus_distance == 2.0
    click(events, 300.0, 100.0)
    assert state.look.settings.lens.focus_distance == 2.0


@pytest.mark.parametrize(("depth", "focus"), [(1e-7, 1e-3), (3e8, 1e6)])
def test_a_click_on_what_is_too_near_or_far_focuses_as_near_it_as_settings_allow(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, depth: float, focus: float
) -> None:
    """What a click set must be worth saving: a camera file or preset beyond the range would not be read again."""
    events, state, _ = rig
    monkeypatch.setattr(FakeStage, "depth_at", lambda *_: depth)
    click(events, 100.0, 100.0)
    assert state.look.settings.lens.focus_distance == focus


@pytest.mark.parametrize("forget", ["focus", "release"])
def test_a_right_drag_looks_until_it_ends(rig: Rig, forget: str) -> None:
    events, state, _ = rig
    events.on_pointer(100.0, 100.0, 0.0, 0.0)
    events.on_button("right", True)
    events.on_pointer(110.0, 100.0, 10.0, 0.0)
    assert state.pilot.active
    state.camera = state.pilot.advance(state.camera, 0.1)
    end: dict[str, Callable[[], None]] = {
        "focus": lambda: events.on_focus(False),
        "release": lambda: events.on_button("right", False),
    }
    end[forget]()
    events.on_pointer(120.0, 100.0, 10.0, 0.0)
    assert not state.pilot.active


def test_tab_looks_around_until_pressed_again_or_the_keyboard_is_lost(rig: Rig) -> None:
    events, _, desktop = rig
    events.on_key("tab", True)
    events.on_key("tab", False)
    assert desktop.captured
    events.on_key("tab", True)
    assert not desktop.captured
    events.on_key("tab", True)
    events.on_focus(False)
    assert not desktop.captured


def test_p_stops_the_motion_and_goes_on_with_it(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    events, state, _ = rig
    state.pass_time(0.25)
    events.on_key("p", True)
    state.pass_time(0.25)
    assert (state.playing, state.time_s) == (False, 0.25)
    assert state.shown.message == "paused at 0.25 s"
    events.on_key("p", True)
    state.pass_time(0.25)
    state.pass_time(60.0)  # a stall
    assert (state.playing, state.time_s) == (True, 1.5)
    monkeypatch.setattr(FakeStage, "moves", False)
    events.on_key("p", True)
    assert state.playing
    assert state.shown.message == "nothing in this scene moves"


def test_a_dropped_file_is_a_request_to_load_it(rig: Rig) -> None:
    events, state, _ = rig
    events.on_drop(["/some/room.glb", "/another.glb"])
    assert state.take_requests() == [Request("load", "/some/room.glb")]
    assert state.take_requests() == []
    events.on_drop(["/some/Preset.JSON"])
    assert state.take_requests() == [Request("load preset", "/some/Preset.JSON")]


def test_the_bar_is_held_from_press_to_release_and_stays_in_the_picture(rig: Rig) -> None:
    events, state, _ = rig
    events.on_key("c", True)
    click(events, PICTURE_WIDTH / 2 + 3.0, 50.0, to=(100.0, 50.0))
    assert state.look.bar == 0.25
    click(events, 100.0, 50.0, to=(-40.0, 50.0))
    assert state.look.bar == 0.0
    assert state.look.settings == Look().settings  # no focus changed
