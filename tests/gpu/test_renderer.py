"""The renderer's promises: when samples are dropped, slices, motion, picking, times, and what it holds."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import moderngl
import numpy as np
import pytest

from app.camera import Camera
from app.errors import UserError
from app.optics import SKY_DEPTH
from app.renderer import Renderer
from app.scene.model import Material
from app.settings import put
from app.tone import srgb_encode

from ..image.stage import Stage, opened, stage_of, untimed
from .small_scenes import quad, scene_of

SIZE = (67, 41)  # no multiple of a work group, a tile or two


@pytest.fixture(scope="module")
def walls(ctx: moderngl.Context) -> Stage:
    """A near wall on the right, a far one behind it up to half height, and the sky above."""
    near, far = quad((0.1, -3, -1.2), (9, 0, 0), (0, 6, 0)), quad((-20, -20, -9), (40, 0, 0), (0, 20, 0), material=1)
    scene = scene_of([near, far], [Material((0.8, 0.2, 0.1, 1.0)), Material((0.1, 0.3, 0.9, 1.0))])
    camera = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(50))
    return stage_of(ctx, scene, camera, lens__aperture=0.3, lens__focus_distance=3.0)


def test_size_view_and_settings_start_afresh(walls: Stage) -> None:
    camera, settings = walls.camera, walls.settings
    renderer = walls.draw("traced", SIZE, spp=4)
    assert renderer.converged_samples == 4
    fresh = renderer.linear()
    renderer.draw("post", camera, settings)
    renderer.draw("post", camera, settings)
    assert renderer.converged_samples == 2
    renderer.draw("traced", camera, put(settings, "rays.samples_per_frame", 4))
    assert renderer.converged_samples == 4, "switching the view kept old samples"
    np.testing.assert_array_equal(renderer.linear(), fresh)
    narrow = put(settings, "lens.aperture", 0.1)
    renderer.draw("traced", camera, narrow)
    assert renderer.converged_samples == 1, "a new aperture kept old samples"
    renderer.draw("traced", camera, put(narrow, "shading.exposure", 1.0))
    assert renderer.converged_samples == 2, "exposure is applied afterwards: it must not drop samples"
    renderer.resize((30, 20))
    renderer.draw("traced", camera, settings)
    assert renderer.converged_samples == 1
    assert renderer.linear().shape == (20, 30, 3)


def test_layers_that_paused_remember_nothing(walls: Stage) -> None:
    """Turned away from all that is near, no rays are traced; turned back, none from before the pause count."""
    renderer = walls.draw("hybrid", SIZE, frames=8)
    traced = []
    for yaw in (*range(0, 100, 10), *range(100, -10, -10)):
        renderer.draw("hybrid", walls.camera.turned(math.radians(yaw), 0.0), walls.settings)
        assert renderer.plan
        traced.append("trace" in {call.step.name for call in renderer.plan.calls})
        if traced[-2:] == [False, True]:
            rays, held = renderer.read("ray_count")[..., 0].max(), renderer.read("layer_state")[..., :2].max()
            assert held <= rays, "the layers hold more rays than were traced since"
            assert renderer.read("scout")[..., 1].max() == 1.0
    assert [b for a, b in pairwise(traced) if a != b] == [False, True]


def test_a_moved_camera_restarts_the_truth(walls: Stage) -> None:
    renderer = walls.draw("traced", SIZE, spp=4)
    renderer.draw("traced", walls.camera.moved(0.1, 0.0, 0.0), walls.settings)
    assert renderer.converged_samples == 1


def test_slices_of_rows_add_up_to_whole_samples(ctx: moderngl.Context) -> None:
    stage = opened(ctx, "still-life")
    whole = stage.linear("traced", SIZE, spp=2)
    renderer = untimed(ctx, stage.renderer.scene)  # two renderers share one scene
    renderer.resize(SIZE)
    frames, most = 0, 2 * math.ceil(SIZE[1] / 8)
    while renderer.converged_samples < 2 and frames < most:
        # So small a budget that each frame does the fewest rows.
        renderer.draw("traced", stage.camera, stage.settings, time_budget_ms=1e-3)
        assert np.isfinite(renderer.picture()).all()
        frames += 1
    sliced = renderer.linear()
    renderer.release()
    assert frames == most
    np.testing.assert_array_equal(sliced, whole)


@pytest.mark.parametrize("view", ["sharp", "post", "hybrid", "reference"])
def test_a_time_budget_changes_nothing_where_no_pass_can_be_sliced(ctx: moderngl.Context, view: str) -> None:
    stage = opened(ctx, "still-life")
    pictures = []
    for budget in (None, 1e-3):
        renderer = untimed(ctx, stage.renderer.scene)
        renderer.resize(SIZE)
        for _ in range(3):
            renderer.draw(view, stage.camera, stage.settings, time_budget_ms=budget)
        assert renderer.converged_samples == 3
        pictures.append(renderer.linear())
        renderer.release()
    np.testing.assert_array_equal(*pictures)


def test_the_rounding_of_a_running_mean_restarts_with_it(walls: Stage) -> None:
    renderer = walls.draw("traced_error", SIZE, spp=4)
    renderer.draw("traced_error", walls.camera.moved(0.1, 0.0, 0.0), walls.settings)
    assert renderer.converged_samples == 1
    assert renderer.read("traced")[..., 3].max() == 1.0


def test_pixels_without_a_sample_show_the_sharp_picture(ctx: moderngl.Context, walls: Stage) -> None:
    sharp = walls.draw("sharp", SIZE, settings=put(walls.settings, "temporal.antialias", False)).picture()
    renderer = untimed(ctx, walls.renderer.scene)
    renderer.resize(SIZE)
    renderer.draw("traced", walls.camera, put(walls.settings, "temporal.antialias", False), time_budget_ms=1e-3)
    shown = renderer.picture()
    renderer.release()
    np.testing.assert_array_equal(shown[: SIZE[1] - 8], sharp[: SIZE[1] - 8])  # rows are traced from the bottom up
    assert (shown[SIZE[1] - 8 :] != sharp[SIZE[1] - 8 :]).any()


def test_motion_is_the_picture_s_displacement(walls: Stage) -> None:
    settings = put(walls.settings, "temporal.antialias", False)
    renderer = walls.draw("motion", SIZE, settings=settings)
    assert np.abs(renderer.read("motion")).max() < 1e-4, "a still camera moves only the last bits of the matrices"
    renderer.draw("motion", replace(walls.camera, eye=(0.05, 0.0, 0.0)), settings)
    per_metre = SIZE[1] / (2 * math.tan(walls.camera.fov_y / 2))
    motion, depth = renderer.read("motion"), renderer.read("depth")[..., 0]
    np.testing.assert_allclose(motion[..., 0], -0.05 * per_metre / depth, rtol=2e-3, atol=1e-4)  # float16
    np.testing.assert_allclose(motion[..., 1], 0.0, atol=2e-3)


def test_depth_is_picked_from_the_top_left(walls: Stage) -> None:
    renderer = walls.draw("sharp", SIZE)
    assert renderer.depth_at(SIZE[0] - 2, SIZE[1] - 2) == pytest.approx(1.2, rel=1e-5)
    assert renderer.depth_at(2, SIZE[1] - 2) == pytest.approx(9.0, rel=1e-5)
    assert renderer.depth_at(2, 2) == pytest.approx(SKY_DEPTH)
    assert renderer.depth_at(10**6, 10**6) == pytest.approx(1.2, rel=1e-5), "a click outside picks the nearest pixel"


def test_linear_picture_is_what_display_shows(walls: Stage) -> None:
    renderer = walls.draw("sharp", SIZE, frames=4)
    shown = np.rint(255 * srgb_encode(np.clip(renderer.linear(), 0.0, 1.0)))
    assert np.abs(shown - renderer.picture()).max() <= 1  # the driver may round to the other neighbour


def test_passes_have_times_and_memory_is_counted(ctx: moderngl.Context, walls: Stage) -> None:
    renderer = Renderer(ctx, walls.renderer.scene, SIZE)
    for _ in range(6):
        renderer.draw("post", walls.camera, walls.settings)
    renderer.profiler.flush()
    assert [name for name, _ in renderer.timings] == [call.step.name for call in renderer.plan.calls]
    assert all(0 <= ms < 1e4 for _, ms in renderer.timings)
    assert renderer.memory["lit"] == SIZE[0] * SIZE[1] * 8
    assert renderer.profiler.source
    renderer.release()


def test_an_unknown_view_is_refused_by_name(walls: Stage) -> None:
    with pytest.raises(UserError, match="--view nonsense: there is no such view"):
        walls.draw("nonsense", SIZE)


def test_reloading_shaders_starts_afresh_and_draws_the_same(walls: Stage) -> None:
    before = walls.linear("traced", SIZE, spp=2)
    renderer = walls.renderer
    assert renderer.reload_shaders() is None
    np.testing.assert_array_equal(walls.linear("traced", SIZE, spp=2), before)
