"""The measuring tools measure what they say, keep what they drew, and run from end to end."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image

from app.camera import Camera, Moment
from app.optics import IN_FOCUS_COC_PX, coc_px, coc_scale_px
from app.settings import put

from .. import conftest
from ..gpu.small_scenes import quad, scene_of
from . import ablation, moving, options, references, scores, steadiness, worth, worth_plot
from .paths import LAP, STEP, checked, flown
from .references import BOTH_SIDES, Reference, key, reference
from .stage import Stage, stage_of
from .subjects import SUBJECTS, left_out, present
from .worth_plot import Point, pareto

SIZE = (64, 36)
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(40))
FOCUS, NEAR = 2.0, 1.0  # m
RADIUS_PX = 8.0  # of the near half-plane's blur
DIRECTION = math.radians(25)  # of its edge's normal, from right towards up: nothing that a flip would keep
EDGE_PX = 3.0  # of the edge from the picture's centre


def half_plane(ctx: moderngl.Context) -> Stage:
    """A near half-plane in front of the sky."""
    metre = SIZE[1] / (2 * NEAR * math.tan(CAMERA.fov_y / 2))  # px per metre
    normal = np.array([math.cos(DIRECTION), math.sin(DIRECTION), 0.0])
    along = 10.0 * np.array([-normal[1], normal[0], 0.0])
    corner = normal * EDGE_PX / metre - along / 2 - 10.0 * normal + (0.0, 0.0, -NEAR)
    of_a_metre = float(coc_px(NEAR, coc_scale_px(1.0, SIZE[1], CAMERA.fov_y), 1.0 / FOCUS))
    lens = {"lens__aperture": -RADIUS_PX / of_a_metre, "lens__focus_distance": FOCUS, "shading__mode": "unlit"}
    return stage_of(ctx, scene_of([quad(tuple(corner), tuple(10.0 * normal), tuple(along))]), CAMERA, **lens)


def covered() -> np.ndarray:
    """Share of the lens (h, w) that the half-plane covers: the segment of a disc beyond a chord."""
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2, SIZE[1] / 2 - 0.5 - np.arange(SIZE[1]))
    chord = np.clip((EDGE_PX - x * math.cos(DIRECTION) - y * math.sin(DIRECTION)) / RADIUS_PX, -1.0, 1.0)
    return 0.5 + (chord * np.sqrt(1.0 - chord**2) + np.arcsin(chord)) / math.pi


@pytest.fixture
def cached(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty folder for references."""
    monkeypatch.setattr(references, "FOLDER", tmp_path / "references")
    return tmp_path / "references"


def test_the_region_that_sees_both_sides_is_known_in_closed_form(ctx, cached: Path) -> None:
    spp = 512
    truth = reference(ctx, half_plane(ctx), "half-plane", SIZE, spp)
    # Of spp evenly spread lens points, the edge leaves about sqrt(spp) undecided, by half a point each; and a pixel
    # averages over its own width, in which the share bends by at most the square of that width over the blur's.
    tolerance = 0.5 / math.sqrt(spp) + 0.5 / (2 * RADIUS_PX) ** 2
    np.testing.assert_allclose(truth.near, covered(), atol=tolerance)
    low, high = BOTH_SIDES
    share = covered()
    sure = (np.abs(share - low) > low / 2) & (np.abs(share - high) > low / 2)
    expected = (share > low) & (share < high)
    assert (truth.both_sides == expected)[sure].all()
    assert sure.mean() > 0.8
    assert 0.2 < truth.both_sides.mean() < 0.8


def test_what_is_in_focus_or_behind_it_has_no_two_sides(ctx, cached: Path) -> None:
    stage = half_plane(ctx)
    scale = coc_scale_px(stage.settings.lens.aperture, SIZE[1], CAMERA.fov_y)
    inverse = 1.0 / NEAR - 0.9 * IN_FOCUS_COC_PX / scale  # the half-plane lies just within the focus zone
    stage = replace(stage, settings=put(stage.settings, "lens.focus_distance", 1.0 / inverse))
    truth = reference(ctx, stage, "half-plane", SIZE, 8)
    assert not truth.near.any()
    still = scores.scored(ctx, stage, "sharp", SIZE, 1, truth)
    assert still.error.whole > 0.0
    assert math.isnan(still.error.both_sides)


def test_a_reference_is_drawn_once(ctx, cached: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = half_plane(ctx)
    first = reference(ctx, stage, "half-plane", SIZE, 4)
    monkeypatch.setattr(references, "drawn", lambda *_: pytest.fail("drawn again"))
    again = reference(ctx, stage, "half-plane", SIZE, 4)
    np.testing.assert_array_equal(first.halves, again.halves)
    assert len(list(cached.iterdir())) == 1


def test_a_reference_is_kept_under_all_that_matters_to_it(ctx, monkeypatch: pytest.MonkeyPatch) -> None:
    settings, here = half_plane(ctx).settings, Moment(CAMERA, 0.0)

    def named(device="gpu", scene="a", size=SIZE, spp=4, moment=here, **changed: object) -> str:
        used = settings
        for path, value in changed.items():
            used = put(used, path.replace("__", "."), value)
        return key(device, scene, size, spp, moment, used)

    assert named() == named(mask__sensitivity=3.0, reconstruct__temporal=False)
    others = [
        named(device="another"),
        named(scene="b"),
        named(size=(36, 64)),
        named(spp=8),
        named(moment=Moment(CAMERA, 1.0)),
        named(moment=Moment(CAMERA.moved(0.01, 0.0, 0.0), 0.0)),
        named(lens__aperture=0.123),
        named(shading__background=(0.1, 0.2, 0.3)),
    ]
    monkeypatch.setattr(references, "sources_digest", lambda: "changed")
    names = [*others, named()]
    monkeypatch.undo()
    assert len({named(), *names}) == len(names) + 1


def test_every_named_source_exists() -> None:
    assert all(list(references.ROOT.glob(pattern)) for pattern in references.SOURCES)
    assert len(references.sources_digest()) == 64


def test_the_noise_of_halves_that_agree_is_nothing() -> None:
    half = np.random.default_rng(1).uniform(0.0, 1.0, (36, 64, 4)).astype(np.float32)
    truth = Reference(np.stack([half, half]))
    assert truth.noise == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(truth.picture, half[..., :3], rtol=1e-6)


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
