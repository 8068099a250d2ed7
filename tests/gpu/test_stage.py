"""The stage behind the window, without a window: scenes swap, pictures converge and rest, pixels know their depth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from app.camera import Camera, Viewpoint, look_at, write_viewpoint
from app.errors import UserError
from app.panel.model import Look
from app.settings import Settings, put
from app.window.side import REST_STILL
from app.window.stage import Stage, value_range

SIZE = (64, 36)
CAMERA = look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
WALL = "v -9 -6 {z}\nv 0 -6 {z}\nv 0 6 {z}\nv -9 6 {z}\nf 1 2 3\nf 1 3 4\n"  # covers the left half of the picture


@pytest.fixture(scope="module")
def walls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("walls")
    for name, z in (("near", -3.0), ("far", -8.0)):
        (folder / f"{name}.obj").write_text(WALL.format(z=z))
    (folder / "broken.obj").write_text("v 0 0 0\n")
    return folder


def test_before_the_first_frame_there_is_nothing_to_focus_on_and_nothing_to_save(ctx: moderngl.Context) -> None:
    """A person may click and press F12 while the first scene loads."""
    made = Stage(ctx, lambda text, fraction: None)
    assert made.depth_at(0.5, 0.5, Look()) is None
    with pytest.raises(UserError, match="no picture"):
        made.picture(Look())


@pytest.fixture
def stage(ctx: moderngl.Context, walls: Path) -> Iterator[Stage]:
    made = Stage(ctx, lambda text, fraction: None)
    made.load(str(walls / "near.obj"))
    yield made
    made.release()


def drawn(stage: Stage, look: Look, camera: Camera = CAMERA) -> np.ndarray:
    stage.draw(look, camera, SIZE)
    return stage.picture(look)


def test_depth_is_read_under_the_pixel_and_the_sky_has_none(stage: Stage) -> None:
    look = Look(view="sharp")
    drawn(stage, look)
    assert stage.depth_at(0.25, 0.5, look) == pytest.approx(3.0, rel=1e-6)
    assert stage.depth_at(0.75, 0.5, look) is None


def test_a_scene_that_cannot_be_loaded_leaves_the_old_one(stage: Stage, walls: Path) -> None:
    look = Look(view="sharp")
    before = drawn(stage, look)
    for name in ("broken.obj", "missing.obj"):
        with pytest.raises(UserError):
            stage.load(str(walls / name))
    assert Path(stage.name).name == "near.obj"
    stage.reload_shaders()
    np.testing.assert_array_equal(drawn(stage, look), before)


def test_camera_files_beside_a_scene_come_after_what_headless_commands_choose(stage: Stage, tmp_path: Path) -> None:
    """An unrelated camera file must not decide how a model opens: `shot` and `plan` know nothing of it."""
    (tmp_path / "model.obj").write_text(WALL.format(z=-3))
    stage.load(str(tmp_path / "model.obj"))
    alone = stage.viewpoints
    for name in ("cam", "model"):
        write_viewpoint(tmp_path / f"{name}.json", Viewpoint(CAMERA))
    stage.load(str(tmp_path / "model.obj"))
    assert stage.viewpoints[: len(alone)] == alone
    assert alone[0].aperture
    assert [view.name for view in stage.viewpoints] == ["framing", "model", "cam"]


def test_a_new_scene_takes_the_place_of_the_old(stage: Stage, walls: Path) -> None:
    look = Look(view="sharp")
    drawn(stage, look)
    stage.load(str(walls / "far.obj"))
    assert stage.pending(look, CAMERA, SIZE) == (True, True)
    drawn(stage, look)
    assert stage.depth_at(0.25, 0.5, look) == pytest.approx(8.0, rel=1e-6)


def test_a_still_picture_rests_and_a_moved_camera_wakes_it(stage: Stage) -> None:
    look = Look(view="sharp")
    for _ in range(REST_STILL):
        assert stage.pending(look, CAMERA, SIZE)[1] or not stage.sides
        stage.draw(look, CAMERA, SIZE)
    assert stage.pending(look, CAMERA, SIZE) == (False, False)
    side = stage.sides[0]
    stage.draw(look, CAMERA, SIZE)
    assert side.samples == REST_STILL  # nothing was drawn
    moved = CAMERA.moved(0.1, 0.0, 0.0)
    assert stage.pending(look, moved, SIZE)[0]
    stage.draw(look, moved, SIZE)
    assert side.samples == 1


def test_a_scene_that_plays_never_rests_and_a_paused_one_does(ctx: moderngl.Context) -> None:
    stage = Stage(ctx, lambda text, fraction: None)
    stage.load("toy-train")
    assert stage.moves
    camera, look = stage.viewpoints[0].camera, Look(view="depth")
    for k in range(3):
        assert stage.pending(look, camera, SIZE, 0.1 * k)[0]
        stage.draw(look, camera, SIZE, 0.1 * k)
        assert stage.sides[0].samples == 1
    assert stage.pending(look, camera, SIZE, 0.1 * 2) == (False, False)  # nothing accumulates in this target
    look = Look(view="sharp")
    for _ in range(3):
        stage.draw(look, camera, SIZE, 0.2)
    assert stage.sides[0].samples == 3
    assert stage.pending(look, camera, SIZE, 0.2) == (False, True)
    stage.release()


def test_a_target_without_history_is_drawn_once(stage: Stage) -> None:
    look = Look(view="depth")
    stage.draw(look, CAMERA, SIZE)
    assert stage.pending(look, CAMERA, SIZE) == (False, False)


def test_the_split_screen_shows_each_view_on_its_side(stage: Stage) -> None:
    single = {view: drawn(stage, Look(view=view)) for view in ("base_color", "depth")}
    look = Look(view="base_color", other="depth", compare=True, bar=0.25)
    both = drawn(stage, look)
    np.testing.assert_array_equal(both[:, :16], single["base_color"][:, :16])
    np.testing.assert_array_equal(both[:, 16:], single["depth"][:, 16:])
    drawn(stage, Look(view="depth"))
    assert len(stage.sides) == 1  # the second renderer's memory was given back


def test_a_target_that_nothing_writes_is_refused_with_a_reason(stage: Stage) -> None:
    pinhole = put(Settings(), "lens.aperture", 0.0)
    with pytest.raises(UserError, match="pinhole"):
        stage.draw(Look(settings=pinhole, view="near_blur"), CAMERA, SIZE)
    drawn(stage, Look(settings=pinhole, view="sharp"))  # and the stage goes on


def test_the_fitted_range_leaves_out_the_sky(stage: Stage) -> None:
    look = Look(view="depth")
    drawn(stage, look)
    found = stage.fitted_range(look)
    assert found is not None
    assert found[0] == pytest.approx(3.0, abs=0.01)
    assert found[1] < 10.0
    drawn(stage, replace(look, view="sharp"))
    assert stage.fitted_range(replace(look, view="sharp")) is None


def test_ranges_by_kind() -> None:
    values = np.linspace(-2.0, 6.0, 1001).reshape(-1, 1, 1)
    low, high = value_range(values, "signed")
    assert low == -high
    assert high == pytest.approx(6.0, abs=0.1)
    assert value_range(np.full((4, 4, 1), 7.0), "scalar") == (7.0, 8.0)  # never empty
    assert value_range(np.full((4, 4, 1), np.nan), "scalar") == (0.0, 1.0)
    assert value_range(np.full((4, 4, 2), 3.0), "vector") == (0.0, pytest.approx(3.0 * 2**0.5))


def test_time_slices_add_up_to_the_whole_picture(stage: Stage) -> None:
    look = Look(view="traced")
    stage.draw(look, CAMERA, SIZE)
    while stage.sides[0].samples < 1:
        stage.draw(look, CAMERA, SIZE)
    assert stage.depth_at(0.25, 0.5, look) == pytest.approx(3.0, rel=1e-6)  # of the raster image that stood in at first


def test_stress_scenes_open_in_the_window_and_an_unknown_one_leaves_what_was_shown(ctx: moderngl.Context) -> None:
    stage = Stage(ctx, lambda text, fraction: None)
    stage.load("stress:knife-edges")
    assert len(stage.viewpoints) == 1
    with pytest.raises(UserError, match="no stress scene 'hegde'"):
        stage.load("stress:hegde")
    assert stage.name == "stress:knife-edges"
    stage.load("stress:empty")
    look = Look(view="hybrid")
    stage.draw(look, stage.viewpoints[0].camera, SIZE)
    assert stage.extent == 0.0
    assert stage.picture(look).min() > 0, "sky"
    stage.release()
