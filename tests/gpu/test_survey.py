"""A survey of a small scene: every candidate gets a figure, and it is what numpy measures of the same frames."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.gpu.timing import WALL_CLOCK
from app.measure import survey as module
from app.measure.metrics import measure
from app.measure.reference import drawing
from app.measure.subject import Subject
from app.measure.survey import Survey
from app.renderer import Renderer
from app.settings import Settings

from ..image.half_plane import SIZE, half_plane
from ..image.stage import Stage

FRAMES, POINTS = 3, 8


@pytest.fixture(scope="module")
def stage(ctx) -> Stage:
    return half_plane(ctx)


def drawn(stage: Stage, view: str, settings: Settings) -> Renderer:
    """Another renderer's frames of the same."""
    renderer = stage.renderer
    renderer.resize(SIZE)
    renderer.reset()
    for _ in range(FRAMES):
        renderer.draw(view, stage.camera, settings)
    return renderer


def test_a_survey_finds_every_candidate_what_the_metrics_measure(
    ctx: moderngl.Context, stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("FRAMES", FRAMES), ("WARM_UP", 1), ("POINTS", POINTS), ("CURVE_FRAMES", FRAMES)):
        monkeypatch.setattr(module, name, value)
    renderer = Renderer(ctx, stage.renderer.scene, (8, 8), timing_source=WALL_CLOCK)
    survey = Survey(ctx, renderer)
    survey.aim(Subject(stage.renderer.scene, 0, stage.camera, 0.0, "hybrid", stage.settings, SIZE))
    while survey.step():
        pass
    findings = survey.findings()
    assert renderer.size == SIZE
    assert findings.measured == len(findings.points) == 1 + 5 + 5 + 3

    truth = _reference(stage)
    for candidate, measured in findings.points:
        assert measured is not None
        assert measured.ms > 0.0
        picture = drawn(stage, candidate.view, candidate.settings).linear()
        expected = measure(picture, truth.picture, truth.regions, flip=False)
        assert measured.errors.keys() == expected.keys()
        for region, errors in expected.items():
            # The same frames of the same renderer: nothing may differ but what compiles differently in two programs.
            for figure in ("rmse", "relative_mse", "psnr"):
                found = getattr(measured.errors[region], figure)
                assert found == pytest.approx(getattr(errors, figure), rel=1e-5, nan_ok=True), (candidate.label, region)
        assert np.sqrt(np.mean(measured.difference**2)) == pytest.approx(10 ** (-expected["whole"].psnr / 20), rel=1e-4)
    assert findings.floor is not None
    assert findings.floor["whole"].rmse == truth.floor["whole"].rmse
    assert findings.own is not None
    assert findings.own[1] is {c.label: m for c, m in findings.points}["hybrid, 4 rays"]
    assert [n for n, _ in findings.curve] == [1, 2, 3]
    last, whole = findings.curve[-1][1]["whole"], findings.own[1].errors["whole"]
    assert last.rmse == pytest.approx(whole.rmse), "the curve passes through the point"
    renderer.release()


def _reference(stage: Stage):
    renderer = stage.renderer
    renderer.resize(SIZE)
    steps = drawing(renderer, stage.camera, stage.settings, POINTS)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
