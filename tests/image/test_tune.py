"""Advice on a real scene, tiny: the promise holds when it is measured again, and what cannot be had is said."""

from __future__ import annotations

import json
from collections.abc import Generator
from pathlib import Path
from typing import TypeVar

import moderngl
import pytest

from app.camera import Moment
from app.cli import main
from app.errors import BAD_INPUT, NOT_REACHED, UserError
from app.measure.candidates import Candidate
from app.measure.reference import Reference, drawing
from app.measure.trial import Judge, Trial
from app.measure.tune import Tuning, preset_values
from app.presets import Preset, read_preset, write_preset
from app.settings import put

from .stage import Stage, opened

SIZE, FRAMES = (96, 54), 4
Yielded, Result = TypeVar("Yielded"), TypeVar("Result")
AMPLE_MS = 20_000.0  # for any frame of that size, on any machine


def driven(steps: Generator[Yielded, None, Result]) -> tuple[Result, list[Yielded]]:
    """What a generator returns, and all that it yielded before."""
    seen = []
    while True:
        try:
            seen.append(next(steps))
        except StopIteration as end:
            return end.value, seen


@pytest.fixture(scope="module")
def stage(ctx: moderngl.Context) -> Stage:
    found = opened(ctx, "toy-train")
    found.renderer.resize(SIZE)
    return found


@pytest.fixture(scope="module")
def truth(stage: Stage) -> Reference:
    return driven(drawing(stage.renderer, stage.camera, stage.settings, 64))[0]


def tuning(ctx: moderngl.Context, stage: Stage, truth: Reference, **options: object) -> Tuning:
    stage.renderer.resize(SIZE)
    moment = Moment(stage.camera, 0.0)
    given = {"frames": FRAMES, "views": ("sharp", "post", "traced"), "limit": 9, **options}
    return Tuning(ctx, stage.renderer, moment, stage.settings, Judge(truth, "rmse"), **given)  # type: ignore[arg-type]


def test_the_promise_of_an_error_is_kept_when_measured_again(
    ctx: moderngl.Context, stage: Stage, truth: Reference, tmp_path: Path
) -> None:
    judge = Judge(truth, "rmse")
    errors = [judge.error(stage.linear(view, SIZE, frames=FRAMES)) for view in ("sharp", "post")]
    limit = 0.5 * sum(errors)  # the pinhole misses it, some blur does not
    advice, seen = driven(tuning(ctx, stage, truth, error=limit, fixed=("post.median",)).run())
    assert advice.kept
    assert judge.floor <= advice.figures.error < limit
    assert advice.figures.ms <= advice.figures.high_ms
    assert advice.candidate.settings.post.median == stage.settings.post.median
    assert advice.measured <= 9
    told = [progress for progress in seen if progress.figures]
    assert len({(p.candidate.view, p.candidate.settings) for p in told if p.stage == "search"}) == advice.measured
    assert told[-1].stage == "verify"
    assert len(seen) > 2 * len(told), "it can be interrupted after each frame"

    write_preset(tmp_path / "p.json", Preset(advice.candidate.view, preset_values(advice.candidate, {})))
    preset = read_preset(tmp_path / "p.json")
    assert preset.view == advice.candidate.view
    assert preset.view
    used = preset.applied(stage.settings)
    trial = Trial(ctx, stage.renderer, Moment(stage.camera, 0.0), judge, FRAMES)
    again, _ = driven(trial.run(Candidate("again", preset.view, used), 77, 0, FRAMES))
    assert again.error < limit


def test_within_ample_time_it_is_the_most_accurate_and_the_renderer_is_as_before(
    ctx: moderngl.Context, stage: Stage, truth: Reference
) -> None:
    stage.renderer.seed = 5
    advice, seen = driven(tuning(ctx, stage, truth, ms=AMPLE_MS, views=("sharp", "traced"), limit=4).run())
    told = [p.figures for p in seen if p.figures]
    assert advice.kept
    assert advice.candidate.view == "traced"
    assert advice.candidate.settings.rays.samples_per_frame == 4  # the fourth that was asked for
    assert advice.figures.error >= min(f.error for f in told)
    assert stage.renderer.seed == 5
    assert not stage.renderer.profiler.enabled


def test_what_cannot_be_had_is_said_with_the_closest(ctx: moderngl.Context, stage: Stage, truth: Reference) -> None:
    advice, seen = driven(tuning(ctx, stage, truth, ms=1e-3, views=("sharp", "post")).run())
    assert not advice.kept
    assert all(p.stage == "search" and not p.kept for p in seen)
    assert advice.figures.high_ms == min(p.figures.high_ms for p in seen if p.figures)


def test_an_error_below_the_floor_is_refused_with_the_floor(
    ctx: moderngl.Context, stage: Stage, truth: Reference
) -> None:
    with pytest.raises(UserError, match=f"{Judge(truth, 'rmse').floor:.4g}.*--spp"):
        tuning(ctx, stage, truth, error=1e-6)
    with pytest.raises(UserError, match="--region"):
        Judge(truth, "rmse", "elsewhere").check()
    pinhole = put(stage.settings, "lens.aperture", 0.0)
    stage.renderer.resize(SIZE)
    sharp, _ = driven(drawing(stage.renderer, stage.camera, pinhole, 2))
    with pytest.raises(UserError, match="near_silhouettes: no pixel"):
        Judge(sharp, "rmse", "near_silhouettes").check()


def test_the_command_says_and_saves(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("app.gpu.context.headless_context", lambda: ctx)
    monkeypatch.setenv("HYBRID_DOF_CACHE", str(tmp_path / "cache"))
    given = ["tune", "toy-train", "--size", "96x54", "--spp", "16", "--frames", "2", "--metric", "rmse"]
    given += ["--views", "sharp", "-o", str(tmp_path / "p.json")]
    assert main([*given, "--ms", str(AMPLE_MS), "--shading.mode", "unlit"]) == 0
    out = capsys.readouterr().out
    assert "sharp" in out
    assert "RMSE" in out
    found = json.loads((tmp_path / "p.json").read_text())
    assert (found["view"], found["settings"]) == ("sharp", {"shading.mode": "unlit"})
    assert found["about"]["size"] == [96, 54]
    (tmp_path / "p.json").unlink()
    assert main([*given, "--ms", "0.001"]) == NOT_REACHED
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert "the closest is sharp" in error
    assert main([*given, "--error", "1e-9"]) == BAD_INPUT
    assert "--spp" in capsys.readouterr().err
    assert not (tmp_path / "p.json").exists()
