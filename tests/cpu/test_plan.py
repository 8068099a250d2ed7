"""The planner on small made-up passes: reachability, order, optional inputs, conditional outputs, reasons."""

from __future__ import annotations

from typing import Any

import pytest

from app.errors import UserError
from app.frame.plan import PlanError, plan
from app.frame.records import FramePlan, Need, Pass, split_read
from app.scene.facts import Facts
from app.settings import Settings

FACTS = Facts(near_coc_px=10.0, far_coc_px=10.0)


def planned(output: str, *passes: Pass, facts: Facts = FACTS) -> FramePlan:
    return plan(passes, output, Settings(), facts)


def names(frame: FramePlan) -> list[str]:
    return [call.step.name for call in frame.calls]


def step(name: str, **fields: Any) -> Pass:
    return Pass(name, f"{name}.comp", **fields)


def idle(reason: str) -> Any:
    return lambda settings, facts: Need(False, reason)


A, B, C = step("a", writes=("x",)), step("b", reads=("x",), writes=("y",)), step("c", reads=("y",), writes=("z",))


def test_a_frame_holds_just_what_its_output_needs() -> None:
    assert names(planned("z", A, B, C)) == ["a", "b", "c"]
    assert names(planned("x", A, B, C)) == ["a"]


def test_what_is_left_out_says_why() -> None:
    sleeper = step("d", writes=("w",), needed=idle("there is nothing to do"))
    frame = planned("y", A, B, C, sleeper)
    assert {s.name: s.reason for s in frame.skipped} == {"c": "nothing shown reads it", "d": "there is nothing to do"}
    assert [call.reason for call in frame.calls] == ["its output is read"] * 2


def test_order_is_checked() -> None:
    with pytest.raises(PlanError, match=r"b runs before anything wrote \['x'\]"):
        planned("y", B, A)


def test_a_read_that_nothing_writes_is_named() -> None:
    with pytest.raises(PlanError, match="'x'"):
        planned("y", B)
    with pytest.raises(PlanError, match="'x'"):
        planned("y", step("a", writes=("x",), needed=idle("off")), B)


def test_an_output_that_nothing_writes_says_why() -> None:
    with pytest.raises(UserError, match="the aperture is closed"):
        planned("x", step("a", writes=("x",), needed=idle("the aperture is closed")))
    with pytest.raises(UserError, match="no target"):
        planned("nonsense", A)
    with pytest.raises(UserError, match="calls for none"):
        planned("e", step("a", writes=("x",), writes_if=(("e", lambda s, f: f.emissive),)))


def test_renamed_reads_bind_the_target_to_the_name() -> None:
    frame = planned("v", A, step("r", reads=("color=x",), writes=("v",)))
    assert frame.calls[1].reads == (("color", "x"),)
    assert split_read("color=lit") == ("color", "lit")
    assert split_read("depth") == ("depth", "depth")


def test_optional_inputs_are_read_if_written_and_the_shader_is_told() -> None:
    reader = step("r", reads=("x",), optional=("glow=e",), writes=("v",))
    writer = step("w", writes=("e",))
    with_it, without = planned("v", A, writer, reader), planned("v", A, reader)
    assert names(with_it) == ["a", "w", "r"]
    assert (with_it.calls[-1].reads, with_it.calls[-1].defines) == ((("x", "x"), ("glow", "e")), (("HAS_GLOW", 1),))
    assert (without.calls[-1].reads, without.calls[-1].defines) == ((("x", "x"),), (("HAS_GLOW", 0),))


def test_a_sleeping_writer_of_an_optional_input_is_left_asleep() -> None:
    frame = planned("v", step("w", writes=("e",), needed=idle("off")), step("r", optional=("e",), writes=("v",)))
    assert names(frame) == ["r"]


def test_an_optional_input_written_too_late_is_a_defect() -> None:
    with pytest.raises(PlanError, match=r"r runs before anything wrote \['e'\]"):
        planned("v", step("r", optional=("e",), writes=("v",)), step("w", writes=("e",)))


@pytest.mark.parametrize("emissive", [False, True])
def test_conditional_outputs_exist_only_when_they_apply(emissive: bool) -> None:
    raster = step("g", writes=("x",), writes_if=(("e", lambda s, f: f.emissive),))
    reader = step("r", reads=("x",), optional=("e",), writes=("v",))
    frame = planned("v", raster, reader, facts=Facts(1.0, 1.0, emissive=emissive))
    assert frame.calls[0].writes == (("x", "e") if emissive else ("x",))
    assert frame.calls[0].defines == frame.calls[1].defines == (("HAS_E", int(emissive)),)


def test_a_grid_that_nothing_touches_is_a_defect() -> None:
    """Its texture would be made beside the plan, only to tell a size."""
    with pytest.raises(PlanError, match=r"the size of \['other'\]"):
        plan([step("a", writes=("x",), grid="other")], "x", Settings(), FACTS)
    assert plan([step("a", writes=("x",), grid="x")], "x", Settings(), FACTS).calls


def test_buffers_are_inputs_and_fills_are_outputs() -> None:
    fill, use = step("f", fills=("Work",)), step("u", buffers=("Work",), writes=("v",))
    assert names(planned("v", fill, use)) == ["f", "u"]
    with pytest.raises(PlanError, match="Work"):
        planned("v", use, fill)
    with pytest.raises(PlanError, match="Work"):
        planned("v", use)


def test_history_is_kept_alive_but_not_awaited() -> None:
    """Last frame's value is there before this frame wrote anything, and a pass whose output is only a history still
    runs.
    """
    reader = step("r", history=("old",), writes=("v",))
    writer = step("w", writes=("old",))
    assert names(planned("v", reader, writer)) == ["r", "w"]
    self_reading = step("s", history=("v",), writes=("v",))
    assert names(planned("v", self_reading)) == ["s"]
    assert planned("v", self_reading).targets == {"v"}


def test_updates_are_outputs_that_need_no_writer() -> None:
    frame = planned("mean", A, step("m", reads=("x",), updates=("mean",)))
    assert names(frame) == ["a", "m"]
    assert frame.calls[1].writes == ("mean",)


def test_the_writer_that_runs_wins_over_one_that_sleeps() -> None:
    frame = planned("x", step("slow", writes=("x",), needed=idle("off")), step("fast", writes=("x",)))
    assert names(frame) == ["fast"]


def test_defines_are_sorted_so_that_equal_permutations_are_equal() -> None:
    one = step("d", writes=("x",), defines=lambda s, f: (("B", 1), ("A", 2)))
    assert planned("x", one).calls[0].defines == (("A", 2), ("B", 1))
