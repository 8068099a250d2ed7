"""The window, used with real keys and a real mouse on a virtual display."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from .conftest import CUBE_DEPTH, PICTURE, ROOT, WALL_DEPTH, Driver, seen

MIDDLE = (PICTURE[0] // 2, PICTURE[1] // 2)
WALL, SKY = (40, 90), (290, 90)


def test_it_opens_with_a_picture_of_the_size_asked_for(window: Driver) -> None:
    state = window.state
    assert state["size"] == list(PICTURE)
    assert state["window"][0] > PICTURE[0]  # the panel stands beside it
    window.wait(lambda s: window.title == "sharp - room.obj - hybrid-dof")  # the display follows the log
    assert (state["focus_distance"], state["aperture"]) == (5.0, 0.2)  # of the camera file


def test_f12_saves_what_is_seen_with_its_settings(window: Driver) -> None:
    window.key("F12")
    state = window.wait(lambda s: s["message"].startswith("saved "))
    path = Path(state["message"].removeprefix("saved "))
    assert path.parent == window.folder
    with Image.open(path) as image:
        pixels, facts = np.asarray(image), json.loads(image.text["hybrid-dof"])  # type: ignore[attr-defined]
    assert pixels.shape == (PICTURE[1], PICTURE[0], 3)
    assert pixels.max() > 60  # not black
    assert pixels.std() > 5  # not one colour
    assert facts["settings"]["lens.aperture"] == 0.2
    assert facts["view"] == "sharp"


def test_f12_never_overwrites(window: Driver) -> None:
    before = set(window.folder.glob("*.png"))
    window.key("F12")
    window.wait(lambda s: len(set(window.folder.glob("*.png"))) == len(before) + 1)


@pytest.mark.parametrize(
    ("key", "view"), [("1", "post"), ("2", "hybrid"), ("3", "traced"), ("4", "reference"), ("0", "sharp")]
)
def test_number_keys_choose_the_view(window: Driver, key: str, view: str) -> None:
    window.key(key)
    window.wait(lambda s: s["view"] == view)
    window.wait(lambda s: window.title == f"{view} - room.obj - hybrid-dof")  # the display follows the log


def test_f1_and_f2_show_and_hide(window: Driver) -> None:
    window.key("F1")
    window.wait(lambda s: s["help"])
    window.key("F1", "F2")
    state = window.wait(lambda s: not s["help"] and not s["panel"] and s["size"][0] > PICTURE[0])
    assert state["size"] == state["window"]  # without the panel the picture fills the window
    window.key("F2")
    window.wait(lambda s: s["panel"] and s["size"] == list(PICTURE))


def test_a_click_focuses_on_what_lies_under_it(window: Driver) -> None:
    window.key("0")
    window.wait(lambda s: s["view"] == "sharp")
    for place, depth in ((MIDDLE, CUBE_DEPTH), (WALL, WALL_DEPTH)):
        window.click(*place)
        state = window.wait(lambda s: s["message"].startswith("focus at") and abs(s["focus_distance"] - depth) < 0.01)  # noqa: B023
        # planar depth is interpolated in float32 from positions of a few metres
        assert state["focus_distance"] == pytest.approx(depth, rel=1e-5)
    window.click(*SKY)
    state = window.wait(lambda s: s["message"] == "nothing there to focus on")
    assert state["focus_distance"] == pytest.approx(WALL_DEPTH, rel=1e-5)


def test_a_target_that_these_settings_do_not_produce_falls_back_with_a_reason(
    display: str, scene: Path, tmp_path: Path
) -> None:
    with Driver(display, tmp_path, *seen(scene), "--view", "near_blur", "--lens.aperture", "0") as window:
        assert window.state["view"] == "sharp"
        assert "pinhole" in window.state["message"]


def test_a_preset_chooses_view_and_settings(display: str, scene: Path, tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"view": "post", "settings": {"lens.aperture": 0.1}}')
    with Driver(display, tmp_path, *seen(scene), "--preset", str(tmp_path / "p.json")) as window:
        state = window.state
        assert (state["view"], state["aperture"]) == ("post", 0.1)
        assert state["focus_distance"] == 5.0  # of the camera file


def test_the_bar_of_the_split_screen_can_be_dragged(window: Driver) -> None:
    window.key("c")
    state = window.wait(lambda s: s["other"])
    window.wait(lambda s: " | " in window.title)
    focus = state["focus_distance"]
    middle, goal = round(PICTURE[0] * state["bar"]), 240
    window.drag(1, (middle, 100), (middle + 30, 100), (goal, 100))
    state = window.wait(lambda s: abs(s["bar"] - goal / PICTURE[0]) < 0.01)
    assert state["focus_distance"] == focus  # a drag is no click
    window.key("c")
    window.wait(lambda s: not s["other"])


def test_held_keys_fly_and_losing_the_keyboard_stops_them(window: Driver) -> None:
    before = window.state["eye"]
    window.do("keydown", "d")
    window.wait(lambda s: s["eye"][0] > before[0] + 0.05)
    root = window.do("search", "--maxdepth", "0", ".*").split()[0]
    window.do("windowfocus", root)
    stopped, eye = None, before
    while eye != stopped:  # a slow frame that was begun before is still to come
        stopped = eye
        window.do("sleep", "1")
        eye = window.state["eye"]
    window.do("keyup", "d", "sleep", "1")
    assert window.state["eye"] == stopped
    window.do("windowfocus", "--sync", window.window)
    window.do("keydown", "a")
    window.wait(lambda s: s["eye"][0] < stopped[0] - 0.05)
    window.do("keyup", "a")


def test_a_right_drag_looks_around_and_the_wheel_changes_the_speed(window: Driver) -> None:
    window.drag(3, (100, 90), (140, 90), (180, 90))
    state = window.wait(lambda s: s["forward"][0] > 0.1)
    assert math.hypot(*state["forward"]) == pytest.approx(1.0)
    speed = state["speed"]
    window.do("mousemove", *map(str, MIDDLE), "click", "4")
    window.wait(lambda s: s["speed"] > 1.1 * speed)


def test_the_picture_follows_the_windows_size(window: Driver) -> None:
    wide, high = window.state["window"]
    window.do("windowsize", window.window, str(wide + 64), str(high + 32))
    window.wait(lambda s: s["size"] == [PICTURE[0] + 64, PICTURE[1] + 32])
    window.do("windowsize", window.window, str(wide), str(high))
    window.wait(lambda s: s["size"] == list(PICTURE))


def test_escape_ends_it_with_code_0_and_nothing_on_stderr(window: Driver) -> None:
    window.key("Escape")
    assert window.process.wait(30) == 0
    assert window.process.stderr is not None
    assert window.process.stderr.read() == ""


def test_p_pauses_what_plays(display: str, tmp_path: Path) -> None:
    with Driver(display, tmp_path, "toy-train", "--view", "sharp") as window:
        begin = window.state["time_s"]
        window.wait(lambda s: s["time_s"] > begin + 0.3)
        window.key("p")
        paused = window.wait(lambda s: not s["playing"])["time_s"]
        window.do("sleep", "0.5")
        assert window.state["time_s"] == paused
        window.key("p")
        window.wait(lambda s: s["playing"] and s["time_s"] > paused + 0.1)


def test_f5_reloads_and_a_broken_shader_keeps_the_last_good_one(display: str, scene: Path, tmp_path: Path) -> None:
    for folder in ("app", "glsl", "assets"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    shader = tmp_path / "glsl" / "output" / "display.comp"
    good = shader.read_text()
    with Driver(display, tmp_path, *seen(scene), "--view", "sharp", root=tmp_path) as window:
        shader.write_text(good + "\nthis is no GLSL\n")
        window.key("F5")
        state = window.wait(lambda s: s["shader_error"])
        assert f"output/display.comp:{len(good.splitlines()) + 2}:" in state["shader_error"]
        window.key("F12")
        window.wait(lambda s: s["message"].startswith("saved "))  # it still draws
        shader.write_text(good)
        window.key("F5")
        window.wait(lambda s: not s["shader_error"] and s["message"] == "shaders reloaded")


def run(*arguments: str, display: str | None) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    if display:
        environment["DISPLAY"] = display
    command = [sys.executable, "-m", "app", *arguments]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=120)


@pytest.mark.skipif(sys.platform != "linux", reason="displays are named in the environment on Linux only")
@pytest.mark.parametrize("display_name", [None, ":4095"])
def test_without_a_display_one_sentence_and_code_3(scene: Path, display_name: str | None) -> None:
    done = run(str(scene), display=display_name)
    assert done.returncode == 3
    assert len(done.stderr.splitlines()) == 1
    assert "hybrid-dof shot" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("missing.glb",), "missing.glb"),
        (("still-life", "--view", "shrap"), "shrap"),
        (("frobnicate",), "frobnicate"),
    ],
)
def test_a_bad_scene_or_view_is_one_sentence_and_code_2(display: str, arguments: tuple[str, ...], named: str) -> None:
    done = run(*arguments, display=display)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert named in done.stderr
    assert run(*arguments, display=None).stderr == done.stderr, "the same without a display"
