"""The survey's order, its slices and what it keeps, with a renderer that draws nothing and a clock that it moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.camera import Camera
from app.frame.pipeline import CONVERGING
from app.gpu.timing import GPU_TIMER, WALL_CLOCK
from app.measure import survey as module
from app.measure.candidates import candidates
from app.measure.metrics import measure
from app.measure.subject import Subject, applied, survey_size
from app.measure.survey import DEAR_SAMPLES, FRAMES, OWN, WARM_UP, Survey
from app.settings import Settings, put

SIZE = (8, 6)
LIGHT = {"sharp": 0.2, "post": 0.4, "hybrid": 0.5, "traced": 0.55, "reference": 0.6}
SECONDS = {"sharp": 0.25, "post": 0.5, "hybrid": 1.0, "traced": 2.0, "reference": 0.125}  # of a slice


@dataclass
class FakeRenderer:
    """Each view is one colour; a traced frame takes two slices; every slice moves the clock."""

    now: float = 0.0
    size: tuple[int, int] = SIZE
    seed: int = 0
    drawn: list[str] = field(default_factory=list)
    samples: int = 0
    half: bool = False
    profiler: Any = field(
        default_factory=lambda: SimpleNamespace(
            enabled=False, source=WALL_CLOCK, keep=lambda n: None, flush=lambda: None, samples_ms=dict
        )
    )

    def ready(self, *view: Any, **moment: Any) -> bool:
        return True

    def draw(self, view: str, camera: Camera, settings: Settings, *, time_s: float, time_budget_ms: Any = None) -> None:
        self.now += SECONDS[view] * (9.0 if self.samples < WARM_UP and view == "post" else 1.0)  # slow at first
        self.drawn.append(view)
        self.half = view == "traced" and not self.half
        if not self.half:
            self.samples += settings.rays.samples_per_frame if view in CONVERGING else 1

    @property
    def converged_samples(self) -> int:
        return self.samples

    def resize(self, size: tuple[int, int]) -> None:
        self.size = size

    def reset(self) -> None:
        self.samples, self.half = 0, False

    def linear(self) -> np.ndarray:
        return np.full((self.size[1], self.size[0], 3), LIGHT[self.drawn[-1]], np.float32)

    def read(self, target: str) -> np.ndarray:
        return np.full((self.size[1], self.size[0], 1), 1.0, np.float32)


@pytest.fixture
def renderer(monkeypatch: pytest.MonkeyPatch) -> FakeRenderer:
    monkeypatch.setattr(module, "POINTS", 4)
    monkeypatch.setattr(module, "CURVE_FRAMES", 5)
    monkeypatch.setattr(module, "has_flip", lambda: False)
    return FakeRenderer()


@pytest.fixture
def survey(renderer: FakeRenderer) -> Survey:
    context: Any = SimpleNamespace(finish=lambda: None)
    drawer: Any = renderer
    return Survey(context, drawer, clock=lambda: renderer.now)


SUBJECT = Subject("a scene", 0, Camera(), 0.0, "hybrid", Settings(), SIZE)


def finish(survey: Survey) -> None:
    while survey.step():
        pass


def of_settings(path: str, value: Any) -> Subject:
    return replace(SUBJECT, settings=put(Settings(), path, value))


def test_without_a_subject_there_is_nothing_to_do(survey: Survey, renderer: FakeRenderer) -> None:
    assert survey.done
    assert not survey.step()
    assert survey.findings().points == ()
    assert renderer.drawn == []


def test_everything_is_measured_from_the_reference_over_the_view_on_screen_to_the_dear(
    survey: Survey, renderer: FakeRenderer
) -> None:
    survey.aim(SUBJECT)
    order, slices = [], 0
    while True:
        doing, part = survey.findings().doing, survey.findings().part
        if doing not in order:
            order.append(doing)
        before = len(renderer.drawn)
        if not survey.step():
            break
        slices += 1
        assert len(renderer.drawn) - before <= 1, "a slice is at most one frame"
        assert 0.0 <= part <= 1.0
    labels = [c.label for c in candidates(Settings(), samples=(1, 2, DEAR_SAMPLES))]
    labels.remove("hybrid, 4 rays")  # which is the view on screen
    assert order == ["the reference", "hybrid as it is now", *labels, "convergence", ""]
    findings = survey.findings()
    assert survey.done
    assert findings.part == 1.0
    assert findings.measured == len(findings.points) == len(labels) + 1
    assert [n for n, _ in findings.curve] == [1, 2, 3, 4, 5]


def test_times_are_the_clocks_and_errors_those_of_the_metrics(survey: Survey, renderer: FakeRenderer) -> None:
    survey.aim(SUBJECT)
    finish(survey)
    truth = np.full((SIZE[1], SIZE[0], 3), LIGHT["reference"])
    for candidate, measured in survey.findings().points:
        assert measured is not None
        slices = 2 if candidate.view == "traced" else 1
        assert measured.ms == pytest.approx(1e3 * slices * SECONDS[candidate.view]), (
            "the slow first frames do not count"
        )
        expected = measure(np.full_like(truth, LIGHT[candidate.view]), truth, flip=False)["whole"]
        assert measured.errors["whole"].rmse == pytest.approx(expected.rmse, rel=1e-6)
        assert measured.errors["whole"].psnr == pytest.approx(expected.psnr, rel=1e-6)
        assert (measured.difference == measured.difference[0, 0]).all()
    of_post = renderer.drawn.count("post")
    assert of_post == 5 * FRAMES


def test_a_gpu_timer_that_can_be_trusted_is_asked_for_the_frames(survey: Survey, renderer: FakeRenderer) -> None:
    passes = {"a": [9.0, *[2.0] * (FRAMES - WARM_UP)], "b": [1.0] * (FRAMES - WARM_UP)}
    renderer.profiler.source, renderer.profiler.samples_ms = GPU_TIMER, lambda: passes
    survey.aim(SUBJECT)
    finish(survey)
    assert {measured.ms for _, measured in survey.findings().points if measured} == {3.0}


CHANGES: dict[str, tuple[Callable[[], Subject], set[str]]] = {  # and the views whose figures stay
    "camera": (lambda: replace(SUBJECT, camera=Camera(eye=(1.0, 0.0, 0.0))), set()),
    "time": (lambda: replace(SUBJECT, time_s=1.0), set()),
    "scene": (lambda: replace(SUBJECT, scene="another"), set()),
    "shaders": (lambda: replace(SUBJECT, edition=1), set()),
    "size": (lambda: replace(SUBJECT, size=(4, 3)), set()),
    "lens": (lambda: of_settings("lens.aperture", 0.2), set()),
    "shading": (lambda: of_settings("shading.shadows", False), set()),
    "anti-aliasing": (lambda: of_settings("temporal.antialias", False), {"traced"}),
    "post-process": (lambda: of_settings("post.max_coc", 0.2), {"sharp", "traced"}),
    "mask": (lambda: of_settings("mask.threshold", 0.2), {"sharp", "post", "traced"}),
    "blend": (lambda: of_settings("blend.hit_ratio", 0.5), {"sharp", "post", "traced"}),
    "exposure": (lambda: of_settings("shading.exposure", 2.0), {"sharp", "post", "hybrid", "traced"}),
    "overlay": (lambda: of_settings("overlay.focus_plane", True), {"sharp", "post", "hybrid", "traced"}),
    "view": (lambda: replace(SUBJECT, view="post"), {"sharp", "post", "hybrid", "traced"}),
    "what is tried": (lambda: of_settings("post.rings", 8), {"sharp", "post", "hybrid", "traced"}),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_a_change_leaves_valid_is_kept_and_the_rest_measured_again(survey: Survey, change: str) -> None:
    survey.aim(SUBJECT)
    finish(survey)
    made, kept = CHANGES[change]
    survey.aim(made())
    findings = survey.findings()
    assert {c.view for c, found in findings.points if found} == kept
    assert (findings.floor is not None) == bool(kept), "the reference stays exactly if some figures do"
    finish(survey)
    assert survey.findings().measured == len(findings.points)
    survey.aim(made())
    assert survey.done


def test_the_dear_ones_are_added_when_they_are_wanted(survey: Survey, renderer: FakeRenderer) -> None:
    survey.aim(SUBJECT)
    finish(survey)
    renderer.drawn.clear()
    survey.aim(replace(SUBJECT, dear=True))
    finish(survey)
    assert set(renderer.drawn) == {"traced"}
    assert [c.label for c, _ in survey.findings().points][-1] == "traced, 64 spp"


def test_flip_is_measured_only_when_it_is_wanted_and_from_the_pictures_there_are(
    survey: Survey, renderer: FakeRenderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "has_flip", lambda: True)
    monkeypatch.setattr("app.measure.metrics._flip_evaluator", lambda: SimpleNamespace(evaluate=flip_like))
    survey.aim(SUBJECT)
    finish(survey)
    assert all(math.isnan(m.errors["whole"].flip) for _, m in survey.findings().points if m)
    renderer.drawn.clear()
    survey.aim(replace(SUBJECT, flip=True))
    assert survey.findings().doing == "FLIP of the reference"
    finish(survey)
    findings = survey.findings()
    assert findings.floor is not None
    assert findings.floor["whole"].flip == 0.25
    assert [m.errors["whole"].flip for _, m in findings.points if m] == [0.25] * len(findings.points)
    assert renderer.drawn == []
    survey.aim(SUBJECT)
    assert survey.done


def flip_like(reference: np.ndarray, picture: np.ndarray, kind: str, applyMagma: bool) -> tuple[np.ndarray]:
    return (np.full((*reference.shape[:2], 1), 0.25),)


def test_work_goes_on_unless_a_change_concerns_it(survey: Survey, renderer: FakeRenderer) -> None:
    survey.aim(SUBJECT)
    while survey.findings().doing != "post, 2 rings":
        survey.step()
    for _ in range(3):
        survey.step()
    survey.aim(of_settings("blend.hit_ratio", 0.5))
    assert survey.findings().doing == "post, 2 rings"
    survey.aim(of_settings("post.max_coc", 0.2))
    assert survey.findings().doing == "hybrid as it is now"
    survey.step()
    assert renderer.samples == 1, "and it starts afresh"


def test_a_target_has_no_point_of_its_own(survey: Survey) -> None:
    survey.aim(replace(SUBJECT, view="depth"))
    finish(survey)
    findings = survey.findings()
    assert findings.own is None
    assert findings.curve == ()
    assert findings.measured == len(findings.points)


def test_applying_a_candidate_makes_it_the_view_on_screen_and_moves_no_other(survey: Survey) -> None:
    survey.aim(SUBJECT)
    finish(survey)
    before = survey.findings()
    chosen = next(c for c, _ in before.points if c.label == "hybrid, 16 rays")
    settings = applied(chosen, put(Settings(), "shading.exposure", 1.0))
    assert settings.shading.exposure == 1.0
    survey.aim(replace(SUBJECT, view=chosen.view, settings=settings))
    after = survey.findings()
    assert after.own is not None
    assert after.own[0].label == OWN
    assert after.own[1] is {c.label: found for c, found in before.points}["hybrid, 16 rays"]
    assert after.points == before.points


@pytest.mark.parametrize("size", [(1280, 720), (640, 640), (100, 900), (1, 1)])
def test_the_small_picture_keeps_its_shape_and_never_grows(size: tuple[int, int]) -> None:
    width, height = survey_size(size, 160)
    assert width * height <= 1.05 * 160 * 90
    assert width <= size[0]
    assert height <= size[1]
    if min(size) > 1:
        assert width / height == pytest.approx(size[0] / size[1], rel=0.05)
