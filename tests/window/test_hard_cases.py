"""The window under what a desktop and its user do to it: a pixel large, hidden, closed or interrupted at a bad moment,
on a machine that lacks what it needs.
"""

from __future__ import annotations

import ctypes
import os
import random
import signal
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from app.window.loop import Window, _ClosedWhileLoading

from .conftest import PICTURE, ROOT, Driver, seen

SIDE = 220  # vertices of the hill: large enough to be seen loading, and its tree being built


@pytest.fixture(scope="module")
def hill(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene that takes a moment: 96 000 triangles."""
    path = tmp_path_factory.mktemp("hill") / "hill.obj"
    lines = [f"v {i / 55 - 2} {(i * j) % 7 / 70} {-j / 55 - 1}" for j in range(SIDE) for i in range(SIDE)]
    for a in (j * SIDE + i + 1 for j in range(SIDE - 1) for i in range(SIDE - 1)):
        lines += [f"f {a} {a + 1} {a + SIDE}", f"f {a + 1} {a + SIDE + 1} {a + SIDE}"]
    path.write_text("\n".join(lines) + "\n")
    return path


def press_close_button(display: str, window: Driver) -> None:
    """What a window manager sends for it; xdotool of common systems cannot."""
    from pyglet.libs.x11 import xlib

    window.find()
    server = xlib.XOpenDisplay(display.encode())
    event = xlib.XEvent()
    event.xclient.type, event.xclient.format = xlib.ClientMessage, 32
    event.xclient.window = int(window.window)
    event.xclient.message_type = xlib.XInternAtom(server, b"WM_PROTOCOLS", 0)
    event.xclient.data.l[0] = xlib.XInternAtom(server, b"WM_DELETE_WINDOW", 0)
    xlib.XSendEvent(server, event.xclient.window, 0, 0, ctypes.byref(event))
    xlib.XCloseDisplay(server)


def is_at(moment: str, state: dict[str, Any]) -> bool:
    doing = (state.get("preparing") or ("",))[0]
    return {
        "loading": "scene" in state and not state["scene"],
        "compiling": doing == "compiling shaders",
        "building the tree": doing not in ("", "compiling shaders"),
        "drawing": state["drawn"],
    }[moment]


@pytest.mark.parametrize("how", ["closed", "interrupted"])
@pytest.mark.parametrize("moment", ["loading", "compiling", "building the tree"])
def test_it_ends_at_once_whatever_it_is_doing(
    display: str, hill: Path, tmp_path: Path, moment: str, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HYBRID_DOF_CACHE", str(tmp_path / "cache"))
    view = "post" if moment == "compiling" else "traced"
    window = Driver(display, tmp_path, str(hill), "--view", view)
    window.wait(lambda state: is_at(moment, state))
    if how == "closed":
        press_close_button(display, window)
    else:
        window.process.send_signal(signal.SIGINT)
    assert window.process.wait(30) == (0 if how == "closed" else 130)
    assert window.process.stderr is not None
    assert window.process.stderr.read() == ("" if how == "closed" else "hybrid-dof: interrupted\n")
    assert not window.state["resting"] or not window.state["scene"]
    assert not [path for path in (tmp_path / "cache").rglob("*") if path.is_file()], "half a tree"


@pytest.mark.parametrize("closing", [False, True])
def test_loading_ends_at_its_next_step_once_the_window_was_closed(closing: bool) -> None:
    window = Window.__new__(Window)  # all of it that progress needs
    window._desktop = SimpleNamespace(closing=closing)  # type: ignore[assignment]
    window._last_progress, told = 0.0, []
    window._show_progress = lambda *what: told.append(what)  # type: ignore[method-assign]
    with pytest.raises(_ClosedWhileLoading) if closing else nullcontext():
        window._on_progress("reading geometry", 0.5)
    assert told == [("reading geometry", 0.5)]


def still_works(window: Driver) -> None:
    """A picture of the usual size can be saved."""
    before = window.state["message"]
    window.do("windowfocus", "--sync", window.window)
    window.key("F12")
    window.wait(lambda state: state["message"].startswith("saved ") and state["message"] != before)
    window.wait(lambda state: state["size"] == list(PICTURE))


def test_any_size_and_every_step_of_a_drag(window: Driver) -> None:
    whole = window.state["window"]
    window.key("1")
    for size in ((1, 1), (1, 300), (300, 1), (2, 3)):
        window.do("windowsize", window.window, *map(str, size))
        window.wait(lambda state: state["window"] == list(size) and max(state["size"]) <= 300)  # noqa: B023
    script = random.Random(1)
    for _ in range(40):
        size = (script.randint(1, 1280), script.randint(1, 800))
        window.do("windowsize", window.window, *map(str, size), "sleep", "0.02")
    window.do("windowsize", window.window, *map(str, whole))
    window.wait(lambda state: state["size"] == list(PICTURE))
    still_works(window)


def test_hidden_with_a_key_held_it_stops_and_comes_back(window: Driver) -> None:
    """What minimising does to a window, where no window manager runs."""
    before = window.state["eye"]
    window.do("keydown", "s")
    window.wait(lambda state: state["eye"][2] > before[2] + 0.05)
    window.do("windowunmap", "--sync", window.window, "sleep", "1")
    stopped = window.state["eye"]
    window.do("keyup", "s", "sleep", "0.5")
    assert window.state["eye"] == stopped
    window.do("windowmap", "--sync", window.window)
    still_works(window)


def run(*arguments: str, **environment: str) -> tuple[int, str]:
    """Exit code and stderr."""
    done = subprocess.run(
        [sys.executable, "-m", "app", *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    return done.returncode, done.stderr


LACKING = {
    "an old OpenGL": {"MESA_GL_VERSION_OVERRIDE": "4.2"},
    "no driver for EGL": {"__EGL_VENDOR_LIBRARY_FILENAMES": "/none"},
}


@pytest.mark.skipif(sys.platform != "linux", reason="Mesa's and glvnd's variables")
@pytest.mark.parametrize("lack", LACKING)
def test_a_picture_without_opengl_is_one_sentence_and_code_3(tmp_path: Path, lack: str) -> None:
    code, said = run("shot", "still-life", "-o", str(tmp_path / "a.png"), **LACKING[lack])
    assert (code, said.count("\n")) == (3, 1)
    assert "no OpenGL 4.3" in said
    assert "install a driver" in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="Mesa's variable")
def test_a_window_without_opengl_is_one_sentence_and_code_3(display: str) -> None:
    code, said = run("view", "still-life", DISPLAY=display, **LACKING["an old OpenGL"])
    assert (code, said.count("\n")) == (3, 1)
    assert "OpenGL 4.3" in said
    assert "hybrid-dof shot" in said


def test_it_opens_where_nothing_can_be_remembered(
    display: str, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither a tree nor the panel's layout."""
    (tmp_path / "config").write_text("a file where a folder should be")
    monkeypatch.setenv("HYBRID_DOF_CACHE", str(tmp_path / "config" / "cache"))
    with Driver(display, tmp_path, *seen(scene), "--view", "traced") as window:
        window.wait(lambda state: state["view"] == "traced" and not state["preparing"])
        window.key("Escape")
        assert window.process.wait(30) == 0
        assert window.process.stderr is not None
        assert window.process.stderr.read() == ""
