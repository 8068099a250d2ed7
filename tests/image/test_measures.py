"""The measuring tools measure what they say, and run from end to end."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from .. import conftest
from . import ablation, moving, options, steadiness, worth, worth_plot
from .half_plane import CAMERA, SIZE
from .paths import LAP, STEP, checked, flown
from .subjects import SUBJECTS, left_out, present
from .worth_plot import Point, pareto


def test_missing_scenes_are_left_out_with_a_sentence(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(conftest, "SHARED_SCENES", tmp_path)
    assert [subject.name for subject in present(SUBJECTS)] == ["still-life", "toy-train"]
    assert "room, plant, living" in left_out(SUBJECTS)
    assert not left_out(present(SUBJECTS))
    assert worth.main(["plant"]) == 0  # nothing to draw, so no context is opened
    assert capsys.readouterr().out.startswith("Left out: plant, ")


@pytest.mark.parametrize("given", [["no-such"], ["--spp", "3"], ["-o", "no-such-folder/x.md"]])
def test_a_wrong_argument_ends_with_a_sentence(given: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        worth.main(given)
    assert "no-such" in capsys.readouterr().err or given[0] == "--spp"


def test_details_scale_with_the_picture() -> None:
    subject = next(s for s in SUBJECTS if s.name == "still-life")
    assert subject.detail_px((640, 360)) == subject.detail
    assert subject.detail_px((320, 180)) == tuple(x // 2 for x in subject.detail)


def test_the_pareto_front_holds_what_nothing_beats() -> None:
    cheap, good, worse, same = Point("a", 1.0, 0.5), Point("b", 4.0, 0.1), Point("c", 5.0, 0.2), Point("d", 4.0, 0.3)
    assert pareto([worse, good, same, cheap]) == [cheap, good]


def test_a_picture_has_settled_when_it_stays_close() -> None:
    near, far = np.zeros((4, 4)), np.full((4, 4), 9.0)
    assert steadiness.settled_after([near, near], 2.0) == 1
    assert steadiness.settled_after([near, far, near], 2.0) == 3
    assert steadiness.settled_after([near, far], 2.0) is None


def test_a_flying_camera_starts_fastest_and_comes_back() -> None:
    assert np.linalg.norm(np.subtract(flown(CAMERA, 2.0, 1).eye, CAMERA.eye)) == pytest.approx(STEP * 2.0, rel=0.01)
    np.testing.assert_allclose(flown(CAMERA, 2.0, LAP).eye, CAMERA.eye, atol=1e-9)
    assert checked(60, 10) == [9, 19, 29, 39, 49, 59]
    assert checked(2, 10) == [1]


@pytest.fixture
def here(ctx, cached: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tools that draw in the session's context."""
    for tool in (worth, moving, ablation):
        monkeypatch.setattr(tool, "headless_context", lambda: ctx)


TINY = ["toy-train", "--size", "64x36", "--frames", "2", "--spp", "32"]


def test_worth_runs(here: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = [tmp_path / name for name in ("w.md", "w.json", "w.png")]
    assert worth.main([*TINY, "-o", str(paths[0]), "--json", str(paths[1]), "--plot", str(paths[2])]) == 0
    assert paths[0].read_text() == capsys.readouterr().out
    views = json.loads(paths[1].read_text())["subjects"][0]["views"]
    assert [v["view"] for v in views] == ["sharp", "post", "hybrid", *(f"traced {n}" for n in worth.TRACED_SAMPLES)]
    flip = {v["view"]: v["flip"] for v in views}
    assert flip["traced 8"] < flip["sharp"]
    assert all(v["ms"] > 0.0 for v in views)
    hybrid = views[2]
    assert 0.0 < hybrid["masked"] < 1.0
    assert hybrid["rays_per_masked_pixel"] == pytest.approx(4.0, rel=0.2)  # the default budget
    assert Image.open(paths[2]).width == int(worth_plot.PANEL_INCHES[0] * worth_plot.DOTS_PER_INCH)


def test_moving_runs(here: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for name, value in {"AGE": 3, "WATCHED": 3, "CONVERGED": 4, "STEADY_AFTER": 2, "FLICKER_FRAMES": 2}.items():
        monkeypatch.setattr(steadiness, name, value)
    assert moving.main([*TINY, "--path-frames", "4", "--every", "2", "--view", "hybrid", "--view", "sharp"]) == 0
    out = capsys.readouterr().out
    assert "| toy-train | hybrid |" in out
    assert "* toy-train, sharp, by frame: 2: 0." in out


def test_ablation_runs(
    here: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(ablation, "steps", lambda settings: [("reconstruct.temporal", False), ("mask.edges", False)])
    arguments = [*TINY, "--path-frames", "2", "--every", "2", "--pictures", str(tmp_path / "sheets")]
    assert ablation.main(arguments) == 0
    out = capsys.readouterr().out
    for label in ("all on", "reconstruct.temporal", "mask.edges", "post-process"):
        assert f"| toy-train | {label} | 0." in out
    assert {path.name for path in (tmp_path / "sheets").iterdir()} == {"toy-train.png", "toy-train-moving.png"}


def test_the_tools_share_their_options() -> None:
    given = options.parser("worth", "").parse_args(["--size", "64x36"])
    assert (given.size, given.frames, given.spp, given.subjects) == (SIZE, 16, 1024, [])
