"""What is left out is measured by drawing it: costs, savings, and everything as it was before."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from app.camera import Moment
from app.frame.pipeline import PASSES
from app.measure.savings import FRAMES, WARM_UP, Costs, measuring
from app.panel.model import Look, Request, Shown
from app.renderer import Renderer
from app.settings import Settings, put
from app.window.requests import Requests
from app.window.stage import Stage
from app.window.state import State

from .test_advisor import WALLS

SIZE = (48, 32)
PINHOLE = put(Settings(), "lens.aperture", 0.0)
WIDE = put(put(Settings(), "lens.aperture", 2.0), "lens.focus_distance", 8.0)


@pytest.fixture
def rig(ctx: moderngl.Context, tmp_path: Path) -> Iterator[tuple[State, Stage, Requests]]:
    (tmp_path / "walls.obj").write_text(WALLS)
    stage = Stage(ctx, lambda text, fraction: None)
    state = State(Look(view="hybrid"), Shown())
    made = Requests(state, stage, tmp_path)
    made.load(str(tmp_path / "walls.obj"))
    yield state, stage, made
    made.stop()
    stage.release()


def costs_of(ctx: moderngl.Context, renderer: Renderer, view: str, moment: Moment, settings: Settings) -> Costs:
    steps, parts = measuring(ctx, renderer, view, moment, settings, rounds=1), []
    try:
        while True:
            parts.append(next(steps))
    except StopIteration as end:
        assert parts == sorted(parts)
        assert len(parts) == 2 * (WARM_UP + FRAMES)
        return end.value


def test_a_pinhole_saves_all_that_a_lens_costs(ctx: moderngl.Context, rig: tuple[State, Stage, Requests]) -> None:
    state, stage, _ = rig
    renderer, moment = stage.renderer(SIZE), Moment(state.camera, 0.0)
    costs = {cost.name: cost for cost in costs_of(ctx, renderer, "hybrid", moment, PINHOLE).passes}
    assert costs.keys() >= {step.name for step in PASSES}
    for name in ("gather", "post", "trace", "composite"):
        assert costs[name].ms is None
        assert costs[name].saved_ms == costs[name].full_ms
        assert costs[name].full_ms is not None
        assert costs[name].full_ms > 0.0
        assert costs[name].reason == "the aperture is 0, a pinhole: everything is sharp"
    assert costs["gbuffer"].ms is not None
    assert costs["gbuffer"].full_ms is not None
    assert (costs["traced"].ms, costs["traced"].full_ms) == (None, None), "no hybrid frame has it"
    renderer.release()


def test_nothing_is_saved_where_all_is_needed(ctx: moderngl.Context, rig: tuple[State, Stage, Requests]) -> None:
    state, stage, _ = rig
    renderer = stage.renderer(SIZE)
    costs = costs_of(ctx, renderer, "hybrid", Moment(state.camera, 0.0), WIDE)
    left_out = {cost.name for cost in costs.passes if cost.ms is None and cost.full_ms is not None}
    assert left_out == {"motion", "gradient"}, "a still picture"
    assert costs.ms == pytest.approx(sum(cost.ms for cost in costs.passes if cost.ms is not None))
    renderer.release()


@pytest.mark.parametrize("finished", [True, False])
def test_measuring_leaves_the_renderer_as_it_was(
    ctx: moderngl.Context, rig: tuple[State, Stage, Requests], finished: bool
) -> None:
    state, stage, _ = rig
    renderer = stage.renderer(SIZE)
    renderer.profiler.enabled = False

    def picture() -> np.ndarray:
        renderer.reset()
        for _ in range(3):
            renderer.draw("hybrid", state.camera, WIDE)
        return renderer.picture()

    before = picture()
    steps = measuring(ctx, renderer, "hybrid", Moment(state.camera, 0.0), WIDE, rounds=1)
    for _ in steps if finished else range(3):
        if not finished:
            next(steps)
    steps.close()
    assert not renderer.every_effect
    assert not renderer.profiler.enabled
    np.testing.assert_array_equal(picture(), before)
    renderer.release()


def test_the_window_measures_beside_its_picture(rig: tuple[State, Stage, Requests]) -> None:
    state, stage, requests = rig
    requests.serve(Request("measure savings"))
    assert "no picture" in state.shown.message
    state.look = replace(state.look, settings=PINHOLE)
    stage.draw(state.look, state.camera, SIZE)
    requests.serve(Request("measure savings"))
    assert requests.ledger.part == 0.0
    while requests.advance():
        pass
    assert requests.ledger.part is None
    assert requests.ledger.full_ms["gather"] > 0.0
    stage.draw(state.look, state.camera, (SIZE[0] // 2, SIZE[1]))
    assert not requests.ledger.full_ms, "of another size"


def test_what_ran_before_is_remembered_until_size_or_scene_change(rig: tuple[State, Stage, Requests]) -> None:
    state, stage, _ = rig

    def before(settings: Settings, size: tuple[int, int] = SIZE) -> dict[str, float]:
        stage.draw(replace(state.look, settings=settings), state.camera, size)
        return dict(stage.costs()[0].before)

    assert before(WIDE) == {}
    assert before(PINHOLE)["gather"] > 0.0
    assert before(PINHOLE, (SIZE[0], SIZE[1] // 2)) == {}
