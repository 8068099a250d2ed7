"""Two benchmarks beside each other: what counts as faster, as changed, and as not comparable."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import pytest

from app.cli import main
from app.measure.bench import times_values
from app.measure.compare import FASTER, SAME, SLOWER, TOO_FEW, compared, time_verdict
from app.measure.timing import FrameTimes, times_of

from .bench_values import results


def frame_times(*ms: float) -> dict[str, object]:
    return times_values(FrameTimes(times_of(ms), {}, times_of(ms), len(ms), 0, "a", "b", "c"))


def test_a_difference_counts_only_beyond_the_noise() -> None:
    base = frame_times(*range(100, 112))
    assert time_verdict(base, frame_times(*range(50, 62)))[1] == FASTER
    assert time_verdict(base, frame_times(*range(200, 212))) == ("1.95", SLOWER)
    assert time_verdict(base, frame_times(*range(103, 115)))[1] == SAME
    assert time_verdict(base, frame_times(50.0, 51.0))[1] == TOO_FEW


def test_the_same_results_are_equal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "bench.json").write_text(json.dumps(results("first", "second")))
    assert main(["bench", "--compare", str(tmp_path / "a"), str(tmp_path / "b" / "bench.json")]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert "Note" not in captured.out
    assert captured.out.splitlines()[-1].startswith("B beside A: ")
    assert captured.out.splitlines()[-1].endswith("errors equal in 36 of 36.")
    assert FASTER not in captured.out


def test_a_slower_program_and_a_changed_error_are_told() -> None:
    a, b = results("first"), results("first", slowed=1.5)
    b["scenes"][0]["runs"][1]["errors"]["16"]["whole"]["flip"] = 0.5
    text = compared(a, b)
    last = text.splitlines()[-1]
    assert f"14 {SLOWER}" in last
    assert f"4 {TOO_FEW}" in last
    assert "errors equal in 17 of 18" in last
    assert "changed: FLIP 0.0631 to 0.5" in text


def test_what_does_not_compare_is_said_in_a_sentence() -> None:
    a, b = results("first", "second"), results("first", "third")
    b |= {"device": "another", "size": [64, 36], "seed": 1}
    b["scenes"][0]["digest"] = "changed"
    del b["scenes"][0]["runs"][0]
    notes = [line for line in compared(a, b).splitlines() if line.startswith("Note: ")]
    for said in ("devices", "64x36", "seeds", "only A has second", "only B has third", "content", "only A has sharp"):
        assert any(said in note for note in notes), said


def test_nothing_in_common_is_said(tmp_path: Path) -> None:
    assert "no scene" in compared(results("first"), results("second"))


def test_other_numbers_of_frames_compare_as_far_as_both_go() -> None:
    a, b = results("first"), copy.deepcopy(results("first"))
    for run in b["scenes"][0]["runs"]:
        run["errors"] = {"1": run["errors"]["1"]}
    assert "equal as far as both go" in compared(a, b)
