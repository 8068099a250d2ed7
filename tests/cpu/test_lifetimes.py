"""Which values share storage: never two at once, never more textures than there are values at once, nothing that is
read later.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.frame.lifetimes import BEFORE, PICKED, Life, Slot, format_of, lifetimes, own_slots, shared_slots
from app.frame.memory import format_bytes, frame_memory, frame_slots, memory_lines, mib
from app.frame.pipeline import PASSES, VIEWS, frame_plan, linear_target, read_after
from app.frame.plan import plan
from app.frame.records import FramePlan, Pass, Target
from app.frame.targets import DEPTH_TEST, TARGETS
from app.scene.facts import Facts
from app.settings import Settings, put

from .test_pipeline import SHOWN, planning_settings
from .test_pipeline import facts as any_facts

BLURRED = Facts(near_coc_px=20.0, far_coc_px=20.0)
MOVING = Facts(near_coc_px=20.0, far_coc_px=20.0, emissive=True, camera_moved=True)
FULL_HD = (1920, 1080)


def step(name: str, **fields: Any) -> Pass:
    return Pass(name, f"{name}.comp", **fields)


def lives_of(output: str, *passes: Pass, kept: tuple[str, ...] = (), **targets: Target) -> dict[tuple[str, bool], Any]:
    """{value: (first, last)}; targets are alike unless given."""
    frame = plan(passes, output, Settings(), BLURRED)
    names = {t for call in frame.calls for t in (*call.writes, *call.step.history)}
    table = {name: targets.get(name, Target(name, 4, "f2", "")) for name in names} | targets
    lives = lifetimes(frame, {output, *kept}, table)
    return {value: (life.first, life.last) for life in lives for value in life.values}


A, B, C = step("a", writes=("x",)), step("b", reads=("x",), writes=("y",)), step("c", reads=("y",), writes=("z",))


def test_a_value_lives_from_its_writer_to_its_last_reader() -> None:
    d = step("d", reads=("x", "z"), writes=("w",))
    assert lives_of("w", A, B, C, d) == {
        ("x", False): (0, 3),
        ("y", False): (1, 2),
        ("z", False): (2, 3),
        ("w", False): (3, 4),  # the output outlives the frame
    }


def test_what_is_read_after_the_frame_outlives_it() -> None:
    assert lives_of("z", A, B, C, kept=("x",))["x", False] == (0, 3)


def test_a_history_is_two_values_that_hand_over() -> None:
    early, late = step("e", history=("h",), writes=("x",)), step("l", reads=("x",), history=("h",), writes=("h", "z"))
    lives = lives_of("z", early, B, late, h=Target("h", 4, "f2", "", history=True))
    assert lives["h", True] == (BEFORE, 1), "until the last pass that reads it"
    assert lives["h", False] == (1, 2), "from the pass that writes it on to the next frame"


def test_a_history_that_nothing_reads_now_is_kept_for_the_next_frame() -> None:
    lives = lives_of("z", step("w", writes=("h", "x")), B, C, h=Target("h", 4, "f2", "", history=True))
    assert ("h", True) not in lives
    assert lives["h", False] == (0, 3)


def test_a_history_that_nothing_writes_now_stays_the_last_frames() -> None:
    lives = lives_of("x", step("r", history=("h",), writes=("x",)), h=Target("h", 4, "f2", "", history=True))
    assert lives == {("x", False): (0, 1), ("h", True): (BEFORE, 1)}


@pytest.mark.parametrize("moving", [False, True])
def test_a_history_written_in_place_is_one_value(moving: bool) -> None:
    motion = (step("m", writes=("motion",)),) * moving
    average = step(
        "r", reads=("x",), optional=("motion",), history=("h",), writes=("h",), in_place_without=(("h", "motion"),)
    )
    frame = plan((A, *motion, average), "h", Settings(), BLURRED)
    table = {n: Target(n, 4, "f2", "", history=n == "h") for n in ("x", "motion", "h")}
    lives = [life for life in lifetimes(frame, ("h",), table) if ("h", False) in life.values]
    after = len(frame.calls)
    assert frame.calls[-1].in_place == (() if moving else ("h",))
    assert [(life.first, life.last) for life in lives] == ([(after - 1, after)] if moving else [(BEFORE, after)])
    assert (("h", True) in lives[0].values) == (not moving)


def test_a_running_mean_lives_always() -> None:
    assert lives_of("m", A, step("m", reads=("x",), updates=("m",)))["m", False] == (BEFORE, 2)


def test_a_continued_slice_finds_what_the_first_one_drew() -> None:
    """Passes before the sliced one run once for all slices of a frame."""
    sliced = step("s", reads=("y",), updates=("m",), sliced=True)
    lives = lives_of("z", A, B, sliced, step("t", reads=("m", "y"), writes=("z",)))
    assert lives["y", False] == (BEFORE, 4)
    assert lives["x", False] == (0, 1), "nothing reads it again"
    assert lives["z", False] == (3, 4)


def test_the_depth_test_lives_while_something_is_rasterised() -> None:
    raster = step("g", kind="raster", writes=("x",))
    assert lives_of("y", raster, B)[DEPTH_TEST.name, False] == (0, 0)
    assert (DEPTH_TEST.name, False) not in lives_of("y", A, B)


FORMATS = (Target("f2", 4, "f2", ""), Target("f4", 4, "f4", ""), Target("half", 4, "f2", "", 2))


@st.composite
def many_lives(draw: st.DrawFn) -> list[Life]:
    spans = draw(st.lists(st.tuples(st.integers(-1, 12), st.integers(0, 6), st.sampled_from(FORMATS)), max_size=40))
    return [Life(((f"t{i}", False),), target, first, first + length) for i, (first, length, target) in enumerate(spans)]


def most_at_once(lives: list[Life]) -> Counter[object]:
    """By format."""
    most: Counter[object] = Counter()
    for at in range(-1, 40):
        most |= Counter(format_of(life.target) for life in lives if life.first <= at <= life.last)
    return most


def assert_sound(slots: tuple[Slot, ...], lives: list[Life]) -> None:
    """Every life has one slot, of its format, to itself while it lasts."""
    assert Counter(life.values for slot in slots for life in slot.lives) == Counter(life.values for life in lives)
    for slot in slots:
        for i, life in enumerate(slot.lives):
            assert format_of(life.target) == slot.format
            assert not any(life.meets(other) for other in slot.lives[i + 1 :])


@given(lives=many_lives())
def test_no_two_meet_in_a_slot_and_no_slot_is_too_many(lives: list[Life]) -> None:
    slots = shared_slots(lives)
    assert_sound(slots, lives)
    assert Counter(slot.format for slot in slots) == most_at_once(lives)
    assert len(own_slots(lives)) == len(lives)


@pytest.mark.parametrize("view", [*VIEWS, "near_gather", "trace_near", "motion"])
@given(settings=planning_settings(), facts=any_facts)
def test_the_pipeline_shares_soundly_whatever_the_scene_and_settings(
    view: str, settings: Settings, facts: Facts
) -> None:
    if view not in VIEWS:  # a target that every scene with blur has
        settings, facts = put(Settings(), "lens.aperture", 0.05), Facts(20.0, 20.0, camera_moved=facts.camera_moved)
    frame = frame_plan(view, settings, facts)
    lives = list(lifetimes(frame, read_after(frame)))
    assert_sound(frame_slots(frame, share=True), lives)
    assert Counter(s.format for s in frame_slots(frame, share=True)) == most_at_once(lives)
    assert {name for life in lives for name, _ in life.values} - {DEPTH_TEST.name} == frame.targets
    assert_nothing_is_overwritten_too_soon(frame)


def assert_nothing_is_overwritten_too_soon(frame: FramePlan) -> None:
    """Told from the calls alone: a texture holds what a call, or whoever comes after the frame, looks for in it."""
    place = {v: i for i, slot in enumerate(frame_slots(frame, share=True)) for life in slot.lives for v in life.values}
    holds: dict[int, tuple[str, bool]] = {}
    for call in frame.calls:
        for name in call.step.history:
            assert holds.setdefault(place[name, True], (name, True)) == (name, True)
        for _, name in call.reads:
            assert holds[place[name, False]] == (name, False)
        for name in call.writes:
            if name in call.step.updates:
                assert holds.setdefault(place[name, False], (name, False)) == (name, False)
            holds[place[name, False]] = (name, False)
    kept = read_after(frame) | {t for call in frame.calls for t in call.writes if TARGETS[t].history}
    for name in kept & {t for call in frame.calls for t in call.writes}:
        assert holds[place[name, False]] == (name, False)


def test_pictures_and_the_depth_under_a_click_are_left() -> None:
    for view in VIEWS:
        frame = frame_plan(view, Settings(), BLURRED)
        assert read_after(frame) == {"display", linear_target(frame), PICKED}
        last = {slot.lives[-1].values for slot in frame_slots(frame, share=True)}
        assert all(any((name, False) in values for values in last) for name in read_after(frame) & frame.targets)
    for name in set(SHOWN) - VIEWS.keys() - {"emissive", "object"}:  # the target viewer's range is fitted afterwards
        assert name in read_after(frame_plan(name, put(Settings(), "temporal.antialias", True), MOVING_OBJECTS))


MOVING_OBJECTS = Facts(20.0, 20.0, emissive=True, objects=True, camera_moved=True, objects_moved=True)


def test_no_pass_reads_a_history_after_it_was_written_in_place() -> None:
    for i, writer in enumerate(PASSES):
        for name, _ in writer.in_place_without:
            assert all(name not in later.history for later in PASSES[i + 1 :])


@pytest.mark.parametrize(
    ("view", "facts", "least"), [("hybrid", BLURRED, 0.34), ("hybrid", MOVING, 0.29), ("post", MOVING, 0.09)]
)
def test_sharing_saves_memory(view: str, facts: Facts, least: float) -> None:
    """So much of what the frame would take without; the still hybrid's third is what the plan was made for."""
    memory = frame_memory(frame_plan(view, Settings(), facts), FULL_HD)
    assert memory.total < (1.0 - least) * memory.unshared


def test_a_pinholes_hybrid_takes_what_sharp_does() -> None:
    pinhole = put(Settings(), "lens.aperture", 0.0)
    facts = Facts(near_coc_px=0.0, far_coc_px=0.0)
    hybrid, sharp = (frame_memory(frame_plan(view, pinhole, facts), FULL_HD) for view in ("hybrid", "sharp"))
    assert hybrid == sharp
    assert not any(TARGETS[name].scale == 2 for name in hybrid.targets if name in TARGETS)


def test_the_figures_add_up() -> None:
    frame = frame_plan("hybrid", Settings(), MOVING)
    memory = frame_memory(frame, FULL_HD)
    assert memory.targets["lit"] == 1920 * 1080 * 8
    assert memory.targets["near_layer"] == 2 * 960 * 540 * 16
    assert memory.targets["resolved"] == 2 * format_bytes(format_of(TARGETS["resolved"]), FULL_HD)
    assert frame_memory(frame_plan("sharp", Settings(), BLURRED), FULL_HD).targets["resolved"] == 1920 * 1080 * 16
    assert memory.blocks["RayWork"] == 16 + 4 * 960 * 540
    lines = memory_lines(frame, FULL_HD)
    assert len(lines) == len(memory.shared) + len(memory.blocks) + 1
    assert lines[-1].startswith(f"{mib(memory.total)} in ")
    assert set(memory.targets) == {name for names, _ in memory.shared for name in names}
