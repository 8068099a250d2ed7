"""The benchmark without OpenGL: what is quoted, how much is timed, what is kept, what is refused, what is written."""

from __future__ import annotations

import csv
import io
import json
import math
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from app.bench_options import effort_of, subjects_of
from app.cli import main, parser
from app.errors import BAD_INPUT, UserError
from app.measure.bench import (
    ALLOWANCE_S,
    FEWEST,
    LONGER,
    METRICS,
    SERIES_SAMPLES,
    Effort,
    checkpoints,
    frames_to_time,
    not_below,
    of_series,
    sample_stops,
    times_of_values,
    times_values,
)
from app.measure.bench_progress import Bar, duration
from app.measure.bench_report import csv_text, markdown, on_fronts, write_report
from app.measure.bench_store import Store, read_results
from app.measure.candidates import candidates
from app.measure.metrics import Errors
from app.measure.plots import write_plots
from app.measure.timing import FrameTimes, times_of
from app.settings import Settings

from .bench_values import FLOOR, errors_of, results


def test_nothing_is_quoted_below_the_floor() -> None:
    better, worse = errors_of(FLOOR.rmse / 2), errors_of(FLOOR.rmse * 2)
    floor = errors_of(FLOOR.rmse)
    assert not_below(worse, floor)["at_floor"] == []
    assert not_below(worse, floor)["psnr"] == worse.psnr
    quoted = not_below(better, floor)
    assert quoted["at_floor"] == list(METRICS)
    assert all(quoted[name] == getattr(floor, name) for name in METRICS)


def test_what_is_not_known_or_has_no_limit_is_null() -> None:
    same = not_below(Errors(0.0, 0.0, math.inf), Errors(0.0, 0.0, math.inf))
    assert same == {"rmse": 0.0, "relative_mse": 0.0, "psnr": None, "flip": None, "at_floor": []}
    json.loads(json.dumps(results("a", flip=False), allow_nan=False))


@given(st.floats(1e-4, 1e3), st.integers(1, 100))
def test_dear_frames_are_timed_few_times_but_an_interval_is_had_where_it_is_near(frame_s: float, timed: int) -> None:
    count = frames_to_time(frame_s, timed)
    assert 1 <= count <= timed
    assert count == 1 or count * frame_s <= max(1.0, LONGER) * ALLOWANCE_S
    if FEWEST * frame_s <= ALLOWANCE_S and timed >= FEWEST:
        assert count >= FEWEST


@given(st.integers(1, 200))
def test_errors_are_read_after_powers_of_two_and_at_the_end(frames: int) -> None:
    read = checkpoints(frames)
    assert (read[0], read[-1]) == (1, frames)
    assert all(n == frames or n & (n - 1) == 0 for n in read)


def test_a_frame_of_many_samples_is_read_off_the_series() -> None:
    effort = Effort(frames=16)
    stops = sample_stops(effort)
    assert stops == [1, 2, 4, 8, 16, 32, SERIES_SAMPLES]
    series = {"errors": {str(n): f"after {n}" for n in stops}, "sample_s": 0.5}
    of_label = {c.label: c for c in candidates(Settings())}
    assert of_series(series, of_label["traced, 16 spp"], 16) == (
        {"1": "after 16", "2": "after 32", "4": "after 64"},
        8.0,
    )
    assert of_series(series, of_label["traced, 64 spp"], 16) == ({"1": "after 64"}, 32.0)


def test_times_survive_json() -> None:
    few = times_of([3.0, 4.0])
    values = json.loads(json.dumps(times_values(FrameTimes(few, {}, few, 2, 1, "a", "b", "c")), allow_nan=False))
    back = times_of_values(values["frame"])
    assert (back.median, back.count) == (3.5, 2)
    assert math.isnan(back.low)


# -- what is kept ------------------------------------------------------------------------------------------------------


def test_a_store_goes_on_refuses_another_configuration_and_starts_over(tmp_path: Path) -> None:
    store, mine = Store(tmp_path / "out"), tmp_path / "out" / "mine.txt"
    store.begin({"size": (640, 360), "seed": 0})
    mine.write_text("not a benchmark's")
    store.put("scene", "sharp", {"a": 1})
    store.begin({"size": [640, 360], "seed": 0})
    assert store.get("scene", "sharp") == {"a": 1}
    with pytest.raises(UserError, match=r"another seed, size: .*--fresh"):
        store.begin({"size": [64, 36], "seed": 1})
    store.begin({"size": [64, 36]}, fresh=True)
    assert store.get("scene", "sharp") is None
    assert mine.exists()


def test_a_file_cut_short_counts_as_not_done(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.begin({})
    store.put("scene", "sharp", {"a": 1})
    (tmp_path / "runs" / "scene" / "sharp.json").write_text('{"a": ')
    assert store.get("scene", "sharp") is None


def test_runs_without_their_configuration_are_not_trusted(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.begin({"seed": 0})
    store.put("scene", "sharp", {"a": 1})
    (tmp_path / "runs" / "configuration.json").unlink()
    with pytest.raises(UserError, match="another seed"):
        store.begin({"seed": 0})


# -- what is written ---------------------------------------------------------------------------------------------------


def test_the_report_has_a_row_for_each_scene_candidate_and_region(tmp_path: Path) -> None:
    made = results("first", "second")
    rows = list(csv.DictReader(io.StringIO(csv_text(made))))
    assert len(rows) == 2 * len(candidates(Settings())) * 5
    assert len({(r["scene"], r["candidate"], r["region"]) for r in rows}) == len(rows)
    post = next(r for r in rows if r["candidate"] == "post, 4 rings" and r["region"] == "whole")
    assert (post["setting"], post["value"], post["frames_last"]) == ("post.rings", "4", "16")
    assert post["on_front_first"] in "01"
    assert post["on_front_last"] in "01"
    assert float(post["rmse_first"]) > float(post["rmse_last"]) > 0.07
    assert {path.name for path in write_report(made, tmp_path)} == {"bench.json", "bench.csv", "bench.md"}
    assert read_results(tmp_path) == read_results(tmp_path / "bench.json") == made


def test_the_tables_say_what_is_at_the_floor_how_sure_times_are_and_where_frames_are_fewer() -> None:
    made = results("a")
    hybrid = next(run for run in made["scenes"][0]["runs"] if run["label"] == "hybrid, 16 rays")
    for region in hybrid["errors"]["16"].values():
        region.update(not_below(errors_of(0.001), errors_of(FLOOR.rmse)))
    lines = {line.split("|")[1].strip(): line for line in markdown(made).splitlines() if line.startswith("| ")}
    assert "at the floor (<0.0036)" in lines["hybrid, 16 rays"]
    assert "[" in lines["post, 4 rings"]
    assert "[" not in lines["traced, 64 spp"], "one frame has no interval"
    assert "(1)" in lines["traced, 64 spp"]
    assert "FLIP, 16 frames" in lines["view"]
    assert len({line.count("|") for line in lines.values()}) == 1


def test_without_flip_the_tables_rank_by_rmse() -> None:
    text = markdown(results("a", flip=False))
    assert "RMSE, 16 frames" in text
    assert "FLIP" not in text


def test_the_front_holds_no_candidate_that_another_beats() -> None:
    first, last = on_fronts(results("a")["scenes"][0], 16)
    assert "sharp" in first & last, "the fastest is never beaten"
    assert "hybrid, 16 rays" in last
    assert "traced, 1 spp" not in first, "slower and worse than the post-process"


def test_the_plots_are_pictures_with_something_in_them(tmp_path: Path) -> None:
    files = write_plots(results("a scene"), tmp_path)
    assert [file.name for file in files] == [f"a-scene-{kind}.png" for kind in ("error-time", "passes", "convergence")]
    for file in files:
        with Image.open(file) as picture:
            assert min(picture.size) > 400
            assert len(picture.convert("RGB").getcolors(1 << 24)) > 50


@pytest.mark.parametrize("frames", [1, 2])
def test_a_benchmark_of_little_is_drawn_too(tmp_path: Path, frames: int) -> None:
    made = results("a", frames=frames, timed=1, flip=False)
    made["scenes"][0]["runs"] = made["scenes"][0]["runs"][-1:]
    made["scenes"][0]["runs"][0]["times"]["passes"] = {}
    assert write_plots(made, tmp_path)
    assert markdown(made)


def test_without_matplotlib_a_sentence_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(UserError, match=r"hybrid-dof\[plots\]"):
        write_plots(results("a"), tmp_path)


def test_progress_is_a_line_per_part_with_the_time_to_go() -> None:
    stream, now = io.StringIO(), [0.0]
    bar = Bar([1.0, 1.0, 2.0], stream, lambda: now[0])
    for text, guess, took in (("a", 1.0, 10.0), ("b", 1.0, 10.0), ("c", 2.0, 20.0)):
        bar.begin(text, guess)
        bar.show("inside", 0.5)
        now[0] += took
        bar.end()
    bar.close()
    lines = stream.getvalue().splitlines()
    assert [line.split(";")[0] for line in lines] == ["[1/3] a: 10.0 s", "[2/3] b: 10.0 s", "[3/3] c: 20.0 s"]
    assert "left" in lines[1]
    assert "left" not in lines[2]
    assert [duration(s) for s in (5, 300, 7200)] == ["5 s", "5 min", "2.0 h"]


# -- what is asked for -------------------------------------------------------------------------------------------------


def test_quick_changes_only_what_was_not_given() -> None:
    quick = effort_of(parser().parse_args(["bench", "--quick", "--frames", "9", "--rays", "2,0.5"]))
    assert (quick.frames, quick.rays, quick.spp) == (9, (0.5, 2.0), 64)
    assert effort_of(parser().parse_args(["bench"])) == Effort()


def test_scenes_may_bring_a_camera_each(tmp_path: Path) -> None:
    camera = tmp_path / "low.json"
    camera.write_text('{"eye": [0, 1, 3], "target": [0, 1, 0]}')
    assert [s.name for s in subjects_of([])] == ["still-life", "toy-train"]
    named = subjects_of(["toy-train", f"toy-train@{camera}"])
    assert [(s.name, s.camera_file) for s in named] == [("toy-train", None), ("toy-train@low", str(camera))]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((), "-o DIR"),
        (("-o", "no/such/folder"), "no/such"),
        (("-o", "file"), "is a file"),
        (("nowhere.glb", "-o", "out"), "nowhere.glb"),
        (("still-life@nowhere.json", "-o", "out"), "nowhere.json"),
        (("still-life", "still-life", "-o", "out"), "twice"),
        (("-o", "out", "--views", "post,blurred"), "blurred"),
        (("-o", "out", "--rays", "1,many"), "--rays"),
        (("-o", "out", "--samples", "65"), "--samples"),
        (("-o", "out", "--rings", ""), "--rings"),
        (("-o", "out", "--spp", "7"), "--spp 7"),
        (("-o", "out", "--frames", "0"), "--frames"),
        (("-o", "out", "--lens.aperture", "wide"), "--lens.aperture"),
        (("--compare", "here", "there"), "here"),
        (("--compare", "file", "file"), "file"),
        (("--compare", "a"), "--compare"),
        (("still-life", "--compare", "a", "b"), "--compare"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: tuple[str, ...],
    named: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("{}")
    assert main(["bench", *arguments]) == BAD_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
    assert named in captured.err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
