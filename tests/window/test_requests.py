"""What the window does on request, with a stage that only notes what happened: no display, no GPU."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.camera import Camera, Viewpoint, read_viewpoint
from app.errors import UserError
from app.panel.model import Look, Request, Shown
from app.session import focused
from app.settings import Settings, put
from app.window.requests import Requests
from app.window.state import State
from app.window.status import StatusLog

HERE = Viewpoint(Camera(eye=(1.0, 2.0, 3.0)), 4.0, 0.25, "here")


class FakeStage:
    """One scene that loads, everything else fails."""

    def __init__(self) -> None:
        self.name, self.viewpoints, self.extent = "", (HERE,), 16.0

    def load(self, name: str) -> None:
        if name != "room.glb":
            raise UserError(f"{name} is no scene.")
        self.name = name

    def costs(self) -> tuple[()]:
        return ()

    def picture(self, look: Look) -> np.ndarray:
        return np.zeros((2, 3, 3), np.uint8)

    def reload_shaders(self) -> str:
        return "dof/gather.comp:12: error"

    def fitted_range(self, look: Look) -> tuple[float, float]:
        return -7.0, 7.0


@pytest.fixture
def state() -> State:
    return State(Look(), Shown())


@pytest.fixture
def requests(state: State, tmp_path: Path) -> Requests:
    stage: Any = FakeStage()
    made = Requests(state, stage, tmp_path)
    made.load("room.glb")
    return made


def test_loading_stands_at_the_scenes_first_viewpoint(state: State, requests: Requests) -> None:
    assert state.camera == HERE.camera
    assert (state.look.settings.lens.focus_distance, state.look.settings.lens.aperture) == (4.0, 0.25)
    assert state.pilot.speed == 2.0  # crosses the 16 m in 8 s


def test_options_win_over_the_first_viewpoint_only(tmp_path: Path) -> None:
    state, stage = State(Look(put(Settings(), "lens.aperture", 0.5)), Shown(), {"lens.aperture": 0.5}), FakeStage()
    requests = Requests(state, stage, tmp_path)  # type: ignore[arg-type]
    requests.load("room.glb")
    assert state.look.settings.lens.aperture == 0.5
    requests.serve(Request("load", "room.glb"))
    assert state.look.settings.lens.aperture == 0.25


def test_a_lens_that_a_new_scene_does_not_name_is_what_shot_would_take(tmp_path: Path) -> None:
    """Not that of the scene before, which may have been a thousand times as large."""
    state, stage = State(Look(put(Settings(), "post.rings", 6)), Shown()), FakeStage()
    requests = Requests(state, stage, tmp_path)  # type: ignore[arg-type]
    requests.load("room.glb")
    stage.viewpoints = (Viewpoint(Camera()),)
    requests.serve(Request("load", "room.glb"))
    assert state.look.settings.lens == focused(Settings(), stage.viewpoints[0]).lens == Settings().lens
    assert state.look.settings.post.rings == 6


def test_a_failed_load_is_told_and_stays_told_until_one_succeeds(state: State, requests: Requests) -> None:
    before = state.camera
    requests.serve(Request("load", "junk.glb"))
    assert state.shown.load_error == state.shown.message == "junk.glb is no scene."
    assert state.camera == before
    requests.serve(Request("load", "room.glb"))
    assert state.shown.load_error == ""


def test_a_saved_camera_reads_back(state: State, requests: Requests, tmp_path: Path) -> None:
    requests.serve(Request("save camera"))
    requests.serve(Request("save camera"))
    assert sorted(path.name for path in tmp_path.glob("*.json")) == ["room-hybrid-2.json", "room-hybrid.json"]
    found = read_viewpoint(tmp_path / "room-hybrid.json")
    assert found.camera.eye == HERE.camera.eye
    assert (found.focus_distance, found.aperture) == (4.0, 0.25)


@pytest.mark.parametrize(
    ("wish", "text"), [("screenshot", ""), ("save camera", ""), ("save preset", "mine"), ("save preset", "n" * 300)]
)
def test_a_full_disk_is_a_message_and_the_window_goes_on(
    state: State, requests: Requests, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wish: Any, text: str
) -> None:
    def full(*args: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", full)
    requests.serve(Request(wish, text))
    assert state.shown.message.startswith(f"cannot write {tmp_path}")
    assert list(tmp_path.iterdir()) == []


def test_a_home_that_is_none_is_a_message(state: State, requests: Requests) -> None:
    requests.serve(Request("load preset", "~nobody-of-this-name/a"))
    assert "no such home" in state.shown.message


def test_a_missing_folder_for_screenshots_is_a_sentence(state: State, tmp_path: Path) -> None:
    requests = Requests(state, FakeStage(), tmp_path / "gone")  # type: ignore[arg-type]
    requests.serve(Request("screenshot"))
    assert "gone" in state.shown.message
    assert "no such folder" in state.shown.message


def test_a_saved_preset_loads(state: State, requests: Requests, tmp_path: Path) -> None:
    state.look = Look(put(state.look.settings, "rays.budget", 2.0), "post")
    saved = state.look
    requests.serve(Request("save preset", "mine"))
    assert state.shown.message == f"saved {tmp_path / 'mine.json'}"
    state.look = Look(put(Settings(), "post.rings", 8), "sharp", other="traced")
    requests.serve(Request("load preset", str(tmp_path / "mine.json")))
    assert (state.look.settings, state.look.view, state.look.other) == (saved.settings, "post", "traced")
    requests.serve(Request("save preset", "mine"))  # over itself
    assert state.shown.preset_error == ""


@pytest.mark.parametrize(
    ("wish", "name", "told"),
    [
        ("load preset", "missing", "missing.json"),
        ("load preset", "room.json", "settings"),
        ("save preset", "room.json", "is no preset"),
        ("save preset", "no/folder", "folder"),
        ("save preset", "room.glb", ".json"),
    ],
)
def test_a_preset_that_fails_is_told_and_changes_nothing(
    state: State, requests: Requests, tmp_path: Path, wish: Any, name: str, told: str
) -> None:
    (tmp_path / "room.json").write_text('{"eye": [0, 0, 0]}')
    before = state.look
    requests.serve(Request(wish, name))
    assert told in state.shown.preset_error
    assert state.shown.message == state.shown.preset_error
    assert state.look == before
    assert [path.name for path in tmp_path.iterdir()] == ["room.json"]


def test_a_shader_error_goes_to_the_panel(state: State, requests: Requests) -> None:
    requests.serve(Request("reload"))
    assert state.shown.shader_error == "dof/gather.comp:12: error"


def test_a_fitted_range_becomes_a_setting(state: State, requests: Requests) -> None:
    requests.serve(Request("fit range"))
    overlay = state.look.settings.overlay
    assert (overlay.range_low, overlay.range_high) == (-7.0, 7.0)


def test_going_to_a_viewpoint_without_focus_keeps_the_focus(state: State, requests: Requests) -> None:
    requests.serve(Request("viewpoint", viewpoint=Viewpoint(Camera(eye=(9.0, 9.0, 9.0)))))
    assert state.camera.eye == (9.0, 9.0, 9.0)
    assert state.look.settings.lens.focus_distance == 4.0


def test_the_status_log_holds_changes_only(tmp_path: Path) -> None:
    log = StatusLog(tmp_path / "log")
    for value in (1, 1, 2):
        log.write({"value": value}, pytest.fail)
    log.close()
    assert (tmp_path / "log").read_text().splitlines() == ['{"value": 1}', '{"value": 2}']
    with pytest.raises(UserError, match="--status"):
        StatusLog(tmp_path / "no" / "log")
