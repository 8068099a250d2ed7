"""The window at rest and at work: it costs nothing while nothing changes, and never stalls for more than a program."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.camera import Viewpoint, look_at, write_viewpoint

from .conftest import Driver, seen

IDLE_S = 5.0
MOST_OF_A_CORE = 0.02
VIEWS = dict(zip("01234", ("sharp", "post", "hybrid", "traced", "reference"), strict=True))  # by key

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")


def cpu_s(process: int) -> float:
    """Processor time that a process and its threads have taken, its software rasteriser's among them."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")  # proc(5): utime, stime


def rests(state: dict[str, Any]) -> bool:
    return bool(state["drawn"] and state["resting"] and state["warm"] and not state["message"])


@pytest.fixture(scope="module")
def hills(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """So many triangles that their tree takes some frames to build."""
    across, up = 240, 120
    folder = tmp_path_factory.mktemp("hills")
    vertices = [(0.02 * x - 2.4, 0.3 * math.sin(0.7 * x) * math.cos(0.9 * y) - 0.6, -0.02 * y - 1.0)
                for y in range(up) for x in range(across)]  # fmt: skip
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices]
    for y in range(up - 1):
        for x in range(1, across):
            a = y * across + x
            lines += [f"f {a} {a + 1} {a + across}", f"f {a + 1} {a + 1 + across} {a + across}"]
    (folder / "hills.obj").write_text("\n".join(lines) + "\n")
    viewpoint = Viewpoint(look_at((0, 0, 0), (0, 0, -1)), focus_distance=5.0, aperture=0.2)
    write_viewpoint(folder / "hills.json", viewpoint)
    return folder / "hills.obj"


@pytest.fixture(scope="module")
def idle(display: str, hills: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driver]:
    """A window of its own, at rest: its view is drawn once. No tree is stored from an earlier run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HYBRID_DOF_CACHE", str(tmp_path_factory.mktemp("cache")))
        with Driver(display, tmp_path_factory.mktemp("idle"), *seen(hills), "--view", "depth") as driver:
            driver.wait(rests)
            yield driver


def log(driver: Driver) -> list[dict[str, Any]]:
    return [json.loads(line) for line in driver._status.read_text().splitlines()]


def test_at_rest_it_draws_nothing_and_takes_no_time(idle: Driver) -> None:
    time.sleep(1.0)  # the panel answers the last event for a while
    before, frame = cpu_s(idle.process.pid), idle.state["frame"]
    time.sleep(IDLE_S)
    assert idle.state["frame"] == frame
    assert cpu_s(idle.process.pid) - before < MOST_OF_A_CORE * IDLE_S


def test_rays_that_nobody_asked_for_have_no_tree_and_who_asks_sees_pictures_all_the_while(idle: Driver) -> None:
    assert not any(state["tree"] for state in log(idle))
    first = idle.state["frame"]
    idle.key("2")
    idle.wait(lambda state: state["view"] == "hybrid" and state["tree"] and not state["preparing"])
    waiting = [state for state in log(idle) if state["frame"] > first and state["preparing"]]
    told = {tuple(state["preparing"]) for state in waiting}
    assert len(waiting) > 3, "frames went on"
    assert len(told) > 1, "they told how far it was"
    assert all(what and 0.0 <= part <= 1.0 for what, part in told)
    assert all(state["drawn"] for state in waiting)


def test_once_warm_no_view_and_no_flight_compiles_anything(idle: Driver) -> None:
    idle.key("0")
    idle.wait(lambda state: state["view"] == "sharp" and state["warm"])
    programs, first = idle.state["programs"], idle.state["frame"]
    for key in ("1", "2", "3", "4"):
        for pressed in (key, "0"):
            idle.key(pressed)
            idle.wait(lambda state, view=VIEWS[pressed]: state["view"] == view)
    eye = idle.state["eye"]
    idle.do("keydown", "w", "sleep", "0.3", "keyup", "w")
    idle.wait(lambda state: state["eye"] != eye)
    since = [state for state in log(idle) if state["frame"] > first]
    assert {state["programs"] for state in since} == {programs}
    assert not any(state["preparing"] for state in since)


def test_no_turn_ever_compiled_more_than_one_program(idle: Driver) -> None:
    states = log(idle)
    assert max(state["compiled"] for state in states) == 1
    assert len({state["frame"] for state in states}) == len(states), "a line for each frame"
