"""Shaders edited while the window runs: whatever is wrong with a file, the last good program goes on, and says so."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from app.camera import Camera
from app.data import data_dir
from app.gpu import shaders
from app.panel.model import Look
from app.settings import Settings, put
from app.window.stage import Stage

from .live_objects import live_objects

SIZE = (32, 18)
LOOK = Look(view="post")
SHOWN = "output/display.comp"  # the last pass of every view
COC = "lib/coc.glsl"  # which many include


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the shaders that the program reads from."""
    shutil.copytree(data_dir("glsl"), tmp_path / "glsl")
    monkeypatch.setattr(shaders, "data_dir", lambda kind: tmp_path / kind)
    return tmp_path / "glsl"


@pytest.fixture
def stage(ctx: moderngl.Context, folder: Path) -> Iterator[Stage]:
    made = Stage(ctx, lambda text, fraction: None)
    made.load("stress:mirrors")  # lit by a sun
    yield made
    made.release()


def picture(stage: Stage, look: Look = LOOK) -> np.ndarray:
    stage.draw(look, camera(stage), SIZE)
    return stage.picture(look)


def camera(stage: Stage) -> Camera:
    return stage.viewpoints[0].camera


def append(text: str) -> Callable[[Path], object]:
    return lambda file: file.write_text(file.read_text() + text)


def insert(text: str) -> Callable[[Path], object]:
    """Before the code's first line, where includes stand."""
    return lambda file: file.write_text(text + file.read_text())


def swap(old: str, new: str) -> Callable[[Path], object]:
    def edit(file: Path) -> None:
        assert old in file.read_text()
        file.write_text(file.read_text().replace(old, new))

    return edit


MAIN = "void main() {"
FAULTS: dict[str, tuple[str, Callable[[Path], object], str]] = {  # the file, what happens to it, what is told
    "a syntax error": (SHOWN, append("\nthis is no GLSL\n"), f"{SHOWN}:{{end}}:"),
    "a syntax error in what many include": (COC, append("\nthis is no GLSL\n"), f"{COC}:{{end}}:"),
    "an unknown name": (SHOWN, swap(MAIN, MAIN + " nowhere = 1.0;"), "nowhere"),
    "garbage": (SHOWN, lambda file: file.write_bytes(bytes(range(1, 128)) * 20), SHOWN),
    "no text": (SHOWN, lambda file: file.write_bytes(file.read_bytes() + b"\n\n// \xff\xfe\n"), f"{SHOWN}:{{end}}"),
    "a NUL": (SHOWN, lambda file: file.write_bytes(file.read_bytes() + b"\n// \0\n"), SHOWN),
    "nothing in it": (SHOWN, lambda file: file.write_bytes(b""), SHOWN),
    "the file is gone": (SHOWN, lambda file: file.unlink(), SHOWN),
    "an include is gone": (COC, lambda file: file.unlink(), COC),
    "a folder in its place": (SHOWN, lambda file: (file.unlink(), file.mkdir()), SHOWN),
    "a missing include": (SHOWN, insert('#include "lib/nowhere.glsl"\n'), f"{SHOWN}:1:"),
    "an include of itself": (SHOWN, insert(f'#include "{SHOWN}"\n'), "include cycle"),
    "it compiles but does not link": (
        SHOWN,
        swap(MAIN, "float missing(float x);\n" + MAIN + " if (missing(1.0) > 0.0) return;"),
        "missing",
    ),
    "no main": (SHOWN, swap(MAIN, "void other() {"), SHOWN),
    "it compiles but names another target": (SHOWN, swap("in_color", "in_colour"), "in_colour"),
    "it compiles but another frame block": (
        "shared/structs.glsl",
        swap("float near_plane;", "float near_plane; vec4 surplus[3];"),
        "FrameBlock",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_the_last_good_program_goes_on_until_the_file_is_repaired(
    ctx: moderngl.Context, stage: Stage, folder: Path, fault: str
) -> None:
    name, harm, told = FAULTS[fault]
    before = picture(stage)
    objects = live_objects(ctx)
    whole = (folder / name).read_bytes()
    harm(folder / name)
    end = whole.count(b"\n") + 2 + (fault == "no text")
    error = stage.reload_shaders()
    assert told.format(end=end) in error
    np.testing.assert_array_equal(picture(stage), before)
    other = replace(LOOK, settings=put(Settings(), "shading.tone_map", type(Settings().shading.tone_map)("aces")))
    assert (picture(stage, other) != before).any(), "a permutation that was not compiled yet: of the text before"
    assert stage.reload_shaders() != "", "it is told for as long as it is so"
    if (folder / name).is_dir():
        (folder / name).rmdir()
    (folder / name).write_bytes(whole)
    assert stage.reload_shaders() == ""
    np.testing.assert_array_equal(picture(stage), before)
    more = live_objects(ctx) - objects
    # moderngl leaves an empty program behind where one does not compile: two reloads, and the other tone map's own
    assert set(more) <= {"Program"}
    assert more["Program"] <= 3
