"""Whole frames through the executor: every view, every target, odd sizes; the same inputs give the same bytes."""

from __future__ import annotations

import math

import moderngl
import numpy as np
import pytest

from app.camera import Camera
from app.errors import UserError
from app.frame.pipeline import VIEWS
from app.frame.targets import TARGETS
from app.renderer import Renderer
from app.scene.model import Material
from app.settings import put

from ..image.stage import Stage, opened, stage_of, untimed
from .small_scenes import quad, scene_of

SIZE = (67, 41)  # no multiple of a work group, a tile or two
NAMES = (*VIEWS, *(t for t in TARGETS if t not in ("display", "resolved") and t not in VIEWS))
MISSING = {"still life": {"object"}, "two walls": {"emissive", "object"}}  # what a scene does not call for
SCENES = tuple(MISSING)
SAMPLED = ("hybrid", "traced", "reference")  # views whose picture depends on the seed


@pytest.fixture(scope="module")
def stages(ctx) -> dict[str, Stage]:
    """The default scene, and two untextured walls without a light: one near, one far."""
    near, far = quad((-0.2, -3, -1.2), (9, 0, 0), (0, 6, 0)), quad((-20, -20, -9), (40, 0, 0), (0, 40, 0), material=1)
    walls = scene_of([near, far], [Material((0.8, 0.2, 0.1, 1.0)), Material((0.1, 0.3, 0.9, 1.0))])
    camera = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(50))
    gallery = opened(ctx, "still-life")
    # near circles of confusion of 10 px at this size, so that rays are called for
    wide = put(gallery.settings, "lens.aperture", 0.2)
    return {
        "still life": Stage(gallery.renderer, gallery.camera, wide),
        "two walls": stage_of(ctx, walls, camera, lens__aperture=0.3, lens__focus_distance=3.0),
    }


def finite(renderer: Renderer) -> None:
    """Every target that the frame touched holds numbers."""
    assert renderer.plan is not None
    for target in renderer.plan.targets:
        values = renderer.read(target)
        assert np.isfinite(values).all(), f"{target}: {np.count_nonzero(~np.isfinite(values))} texels are not finite"


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("scene", SCENES)
def test_every_view_and_target_draws(ctx: moderngl.Context, stages: dict[str, Stage], scene: str, name: str) -> None:
    if name in MISSING[scene]:
        with pytest.raises(UserError, match=name):
            stages[scene].draw(name, SIZE)
        return
    renderer = stages[scene].draw(name, SIZE, frames=2, spp=2)
    assert ctx.error == "GL_NO_ERROR"
    finite(renderer)
    picture = renderer.picture()
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    if name in VIEWS:
        assert picture.std() > 5, "the picture is one colour"


@pytest.mark.parametrize("view", VIEWS)
def test_same_seed_same_bytes(ctx: moderngl.Context, stages: dict[str, Stage], view: str) -> None:
    stage = stages["still life"]
    first = stage.linear(view, SIZE, frames=3, spp=4, seed=7)
    # a fresh renderer: nothing is left over from earlier frames
    twin = Stage(untimed(ctx, stage.renderer.scene), stage.camera, stage.settings)
    second = twin.linear(view, SIZE, frames=3, spp=4, seed=7)
    other = twin.linear(view, SIZE, frames=3, spp=4, seed=8)
    twin.renderer.release()
    np.testing.assert_array_equal(first, second)
    assert (view in SAMPLED) == bool((first != other).any())


@pytest.mark.parametrize("scene", SCENES)
def test_a_pinhole_makes_all_views_equal_and_plans_no_blur(stages: dict[str, Stage], scene: str) -> None:
    stage = stages[scene]
    pinhole = put(stage.settings, "lens.aperture", 0.0)
    sharp = stage.linear("sharp", SIZE, frames=64, settings=pinhole)
    passes = {call.step.name for call in stage.renderer.plan.calls}
    for view in ("post", "hybrid"):
        np.testing.assert_array_equal(stage.linear(view, SIZE, frames=64, settings=pinhole), sharp)
        assert {call.step.name for call in stage.renderer.plan.calls} == passes
    assert passes == {"gbuffer", "lighting", "resolve", "display"}
    for view in ("traced", "reference"):
        difference = np.abs(stage.linear(view, SIZE, spp=64, settings=pinhole) - sharp)
        # 64 points a pixel: an edge of unit contrast is known to 0.5 / sqrt(64); few pixels hold more than that.
        assert np.mean(difference > 4 * 0.5 / 8) < 0.01
        assert difference.mean() < 0.02 * sharp.mean() + 0.01


@pytest.mark.parametrize("size", [(1, 1), (1, 23), (23, 1), (3, 2), (16, 16), (17, 33)])
@pytest.mark.parametrize("view", VIEWS)
def test_any_size_draws(ctx: moderngl.Context, stages: dict[str, Stage], view: str, size: tuple[int, int]) -> None:
    renderer = stages["two walls"].draw(view, size, frames=2, spp=2)
    finite(renderer)
    assert renderer.picture().shape == (size[1], size[0], 3)
    assert renderer.picture().any()


@pytest.mark.parametrize("view", ["sharp", "post", "hybrid"])
@pytest.mark.parametrize("scene", SCENES)
def test_a_moving_camera_leaves_no_trace(stages: dict[str, Stage], scene: str, view: str) -> None:
    stage = stages[scene]
    renderer = stage.draw(view, SIZE, frames=2)
    for step in range(1, 5):
        renderer.draw(view, stage.camera.moved(0.02 * step, 0.01 * step, -0.02 * step), stage.settings)
        finite(renderer)
        assert renderer.moved
        assert "motion" in renderer.plan.targets
