"""A virtual display, and a driver that uses the window as a person does: keys, mouse, its title, its status log."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from app.camera import Viewpoint, look_at, write_viewpoint

ROOT = Path(__file__).parents[2]
PICTURE = (320, 180)
PATIENCE_S = 90.0  # for one change: a shader compile on two busy cores
# The room: a cube's face 3 m ahead in the middle of the picture, a wall 8 m ahead over the left half, sky to the right.
CUBE_DEPTH, WALL_DEPTH = 3.0, 8.0


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """A virtual X display of our own, by name."""
    for tool in ("Xvfb", "xdotool"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed: apt-get install xvfb xdotool")
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        if not number:
            pytest.skip("Xvfb did not start here")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few triangles with a camera file beside them."""
    folder = tmp_path_factory.mktemp("scene")
    vertices = [(x, y, z) for z in (-3.0, -3.6) for y in (-0.3, 0.3) for x in (-0.3, 0.3)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3), (2, 3, 7, 6), (0, 4, 5, 1)]
    wall = [(-9.0, -6.0, -8.0), (0.0, -6.0, -8.0), (0.0, 6.0, -8.0), (-9.0, 6.0, -8.0)]
    faces = [*quads, (8, 9, 10, 11)]
    lines = [f"v {x} {y} {z}" for x, y, z in (*vertices, *wall)]
    lines += [
        "f " + " ".join(str(i + 1) for i in triangle) for a, b, c, d in faces for triangle in ((a, b, c), (a, c, d))
    ]
    (folder / "room.obj").write_text("\n".join(lines) + "\n")
    write_viewpoint(folder / "room.json", Viewpoint(look_at((0, 0, 0), (0, 0, -1)), focus_distance=5.0, aperture=0.2))
    return folder / "room.obj"


def seen(scene: Path) -> tuple[str, ...]:
    """The arguments that open a scene as the camera file beside it sees it."""
    return str(scene), "--camera", str(scene.with_suffix(".json"))


class Driver:
    """A running window. `wait` polls its status log; every wait fails with the last state it saw."""

    def __init__(self, display: str, folder: Path, *arguments: str, root: Path = ROOT) -> None:
        self.folder, self._status = folder, folder / "status.jsonl"
        settings = {"DISPLAY": display, "XDG_CONFIG_HOME": str(folder / "config"), "LIBGL_ALWAYS_SOFTWARE": "1"}
        self._environment = {**os.environ, **settings}
        width, height = PICTURE
        command = [sys.executable, "-m", "app", "view", *arguments, "--size", f"{width}x{height}"]
        command += ["--status", str(self._status), "--screenshots", str(folder)]
        self._others = self._windows()
        self.process = subprocess.Popen(command, cwd=root, env=self._environment, stderr=subprocess.PIPE, text=True)
        self.window = ""

    def __enter__(self) -> Driver:
        self.wait(lambda state: state["drawn"])
        self.find()
        self.do("windowfocus", "--sync", self.window)
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait()

    def find(self) -> None:
        """Set `window`: the one that has been there only since this driver started, as processes are not told."""
        (self.window,) = self._windows() - self._others

    def _windows(self) -> set[str]:
        command = ["xdotool", "search", "--name", "hybrid-dof"]  # fails where there is none
        return set(subprocess.run(command, env=self._environment, capture_output=True, text=True).stdout.split())  # noqa: PLW1510

    def do(self, *arguments: str) -> str:
        """One xdotool command."""
        done = subprocess.run(
            ["xdotool", *arguments], env=self._environment, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    def key(self, *names: str) -> None:
        self.do("key", "--delay", "50", *names)

    def click(self, x: int, y: int) -> None:
        self.do("mousemove", str(x), str(y), "click", "1")

    def drag(self, button: int, *points: tuple[int, int]) -> None:
        """Press at the first point, pass through the others, release at the last."""
        self.do("mousemove", *map(str, points[0]), "mousedown", str(button))
        for point in points[1:]:
            self.do("mousemove", *map(str, point), "sleep", "0.05")
        self.do("mouseup", str(button))

    @property
    def title(self) -> str:
        return self.do("getwindowname", self.window)

    @property
    def state(self) -> dict[str, Any]:
        """The last line of the status log that is written to its end."""
        text = self._status.read_text() if self._status.exists() else ""
        lines = text[: text.rfind("\n") + 1].splitlines()
        return dict(json.loads(lines[-1])) if lines else {"drawn": False}

    def wait(self, condition: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """The first state from now that meets the condition."""
        deadline = time.monotonic() + PATIENCE_S
        while not condition(self.state):
            if self.process.poll() is not None:
                pytest.fail(f"the window ended with code {self.process.returncode}: {self.process.stderr.read()}")  # type: ignore[union-attr]
            if time.monotonic() > deadline:
                pytest.fail(f"still waiting after {PATIENCE_S:g} s; last state: {self.state}")
            time.sleep(0.02)
        return self.state


@pytest.fixture(scope="module")
def shared_window(display: str, scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driver]:
    """One window that the tests of a module share."""
    with Driver(display, tmp_path_factory.mktemp("window"), *seen(scene), "--view", "sharp") as driver:
        yield driver


@pytest.fixture
def window(shared_window: Driver) -> Driver:
    """The same, with the keyboard, which another window may have had meanwhile. Each test sets what else it needs."""
    if shared_window.process.poll() is None:
        shared_window.do("windowfocus", "--sync", shared_window.window)
    return shared_window
