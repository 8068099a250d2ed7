"""Long flights through everything the window can do: no GL error, no bad texel, and nothing that grows.

What a flight takes (programs, and the code that the driver makes of them) depends on where it goes. So the same flight
is flown several times: the first lap may take what it needs, the others nothing more.
"""

from __future__ import annotations

import ctypes
import gc
import shutil
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import moderngl
import pytest

from app.data import data_dir
from app.frame.records import FramePlan
from app.gpu import shaders
from app.gpu.health import Health
from app.gpu.programs import MOST_PROGRAMS
from app.gpu.timing import spare_queries

from .flight import Flight
from .live_objects import live_objects

STATM = Path("/proc/self/statm")
DEEDS = {
    *("look_at_another_view", "change_a_setting", "change_the_size", "press_or_let_go", "split_the_screen", "measure"),
    *("load_another_scene", "reload", "cut", "pictures", "slices with the map", "slices of the survey"),
}
# Growth of process memory from one lap to the next [MiB]: laps differ by what the clock decides (how many slices fit),
# and the allocator keeps what is split; 0.1 to 0.7 were measured. What is left on the GPU is counted one by one.
GROWTH_MIB = 4.0
# Where programs are compiled again, since their text was edited or since they were not ready when the lap before ended,
# llvmpipe's memory goes up and down with its code: of a program it keeps 0.9, and of all together it was never further
# from one lap to the next than 24 (481, 506, 496, 499 after laps of 5000 frames and 5681 programs each). The long form
# therefore sees whatever grows by 7 kB a frame, or by 6 kB a program: less than a picture, or a shader's text.
CODE_MIB, ALL_CODE_MIB = 2.0, 32.0


@dataclass(frozen=True)
class Kept:
    """What is there after a lap."""

    objects: Counter[str]  # on the GPU, without programs
    programs: int  # kept on purpose
    left: int  # and those that are not
    compiled: int  # in this lap, without those that could not be
    memory_mib: float

    def growth_allowed_mib(self) -> float:
        """Of memory, since the lap before."""
        return GROWTH_MIB + min(CODE_MIB * self.compiled, ALL_CODE_MIB)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the shaders that the program reads from."""
    copy = tmp_path / "glsl"
    shutil.copytree(data_dir("glsl"), copy)
    monkeypatch.setattr(shaders, "data_dir", lambda kind: copy.parent / kind)
    return copy


@pytest.fixture
def bad(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Bad texels by target, in all that any renderer draws, the survey's and the reference's as well."""
    found: Counter[str] = Counter()
    begin, take = Health.begin_frame, Health._take

    def watching_all(health: Health, plan: FramePlan) -> None:
        health.watched = "all"
        begin(health, plan)

    def taken(health: Health, slot: int) -> None:
        queued = health._ring[slot]
        take(health, slot)
        if queued:
            counts = health.found[queued[0]]
            found["countings"] += 1
            found.update({queued[0]: counts.non_finite + counts.negative} if counts else {})

    monkeypatch.setattr(Health, "begin_frame", watching_all)
    monkeypatch.setattr(Health, "_take", taken)
    return found


def memory_mib() -> float:
    """What the process holds, once nothing that waits to be freed does any more. 0 where that is not told."""
    gc.collect()
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):
        trim(0)
    return int(STATM.read_text().split()[1]) * 4096 / 2**20 if STATM.exists() else 0.0


def lap(flight: Flight, seed: int, frames: int) -> Kept:
    """Fly from home and back."""
    kept = flight.stage.rehearsal.programs
    builds, broken = kept.builds, flight.broken
    flight.begin(seed)
    for number in range(frames):
        flight.frame()
        assert flight.ctx.error == "GL_NO_ERROR", f"frame {number}"
    assert set(flight.done) >= DEEDS, "a shorter flight than it should be"
    flight.home()
    assert len(kept) <= MOST_PROGRAMS
    objects = live_objects(flight.ctx)
    left = objects.pop("Program") - len(kept)
    compiled = kept.builds - builds - (flight.broken - broken)
    return Kept(objects, len(kept), left, compiled, memory_mib())


def test_the_same_flight_again_takes_nothing_more(
    ctx: moderngl.Context, folder: Path, bad: Counter[str], soak: bool
) -> None:
    seed, frames, haste = (7, 5000, 1.0) if soak else (11, 60, 8.0)
    begin = live_objects(ctx)
    flight = Flight(ctx, folder, haste)
    first, second = (lap(flight, seed, frames) for _ in range(2))
    assert (second.objects, second.programs) == (first.objects, first.programs)
    assert second.memory_mib - first.memory_mib < second.growth_allowed_mib()
    assert "stand-ins" not in flight.done

    rehearsal = flight.stage.rehearsal
    rehearsal.programs.release()  # what follows begins with none, as the window does ...
    rehearsal.a_turn = 1  # ... and pictures wait for programs, while trees are built in a thread
    third = lap(flight, seed, frames)
    assert flight.done["stand-ins"]
    fourth = lap(flight, seed, frames)
    assert third.objects == fourth.objects == first.objects
    assert fourth.memory_mib - third.memory_mib < fourth.growth_allowed_mib()

    # moderngl leaves an empty program behind where one does not compile
    assert fourth.left - begin["Program"] <= flight.broken
    flight.release()
    left = live_objects(ctx) - begin
    assert left.pop("Program", 0) <= flight.broken
    assert left.pop("Query", 0) <= len(spare_queries(ctx)), "moderngl cannot release one: they are kept and used again"
    assert not left
    assert bad.pop("countings") > 4 * frames
    assert not bad
