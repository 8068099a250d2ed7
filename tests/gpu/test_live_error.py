"""What the GPU measures of a frame is what numpy measures of the same pictures."""

from __future__ import annotations

import math
from dataclasses import astuple

import moderngl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from app.camera import Moment
from app.gpu.error_sums import BLOCK, ErrorSums
from app.gpu.programs import Programs
from app.gpu.timing import RING
from app.measure import metrics
from app.measure.live import HEAT_RANGE, LiveError, errors_of_sums
from app.measure.reference import Reference
from app.measure.regions import REGIONS, region_masks
from app.panel.colormap import sequential
from app.settings import Overlay

from ..image.half_plane import SIZE, half_plane
from ..image.stage import Stage
from .harness import call_glsl

# What float32 may err by: a pixel's own error by a few roundings and by the display curve's power, which GLSL leaves to
# the driver; the sums by 2^-24 of themselves for each addition on a way of a block and a row of blocks.
PIXEL = 2.0**-16


def tolerance(width: int) -> float:
    return PIXEL + (BLOCK * BLOCK + width / BLOCK) * 2.0**-24


def texture(ctx: moderngl.Context, picture: np.ndarray) -> moderngl.Texture:
    texels = np.dstack([picture, np.ones(picture.shape[:2])]).astype(np.float32)[::-1]
    return ctx.texture((picture.shape[1], picture.shape[0]), 4, np.ascontiguousarray(texels), dtype="f4")


def measured(
    ctx: moderngl.Context, programs: Programs, picture: np.ndarray, truth: np.ndarray, labels: np.ndarray
) -> np.ndarray:
    sums, given = ErrorSums(ctx, programs, len(REGIONS)), texture(ctx, picture)
    sums.set_truth(truth, labels)
    sums.queue(given)
    result = sums.sums(age=0)
    sums.release()
    given.release()
    assert result is not None
    return result


def assert_close(measured: dict[str, metrics.Errors], expected: dict[str, metrics.Errors], relative: float) -> None:
    assert list(measured) == list(expected)
    for name, errors in measured.items():
        other = expected[name]
        assert errors.rmse == pytest.approx(other.rmse, rel=relative, nan_ok=True), name
        assert errors.relative_mse == pytest.approx(other.relative_mse, rel=2 * relative, nan_ok=True), name
        assert errors.psnr == pytest.approx(other.psnr, abs=20 * math.log10(1 + relative), nan_ok=True), name


COLORS = arrays(np.float32, (16, 3), elements=st.floats(0.0, 8.0, width=32))


@settings(max_examples=20)
@given(light=COLORS, truth=COLORS)
def test_a_pixels_errors_are_its_twins(ctx, light: np.ndarray, truth: np.ndarray) -> None:
    found = call_glsl(ctx, "lib/errors.glsl", "vec3 squared_errors(vec3 light, vec3 truth)", light, truth)
    expected = np.stack(metrics.squared_errors(light[None], truth[None]), -1)[0]
    # A displayed difference is one of two numbers up to 1, each off by a few ulp: its square by 2 |d| of that.
    np.testing.assert_allclose(found, expected, rtol=PIXEL, atol=2 * 2.0**-19)


@pytest.mark.parametrize("size", [(1, 1), (64, 36), (129, 257), (1920, 1080)])
def test_sums_over_regions_are_numpys(ctx: moderngl.Context, programs: Programs, size: tuple[int, int]) -> None:
    random = np.random.default_rng(size[0])
    truth = np.float32(random.uniform(0.0, 2.0, (size[1], size[0], 3)))
    picture = np.float32(truth * random.uniform(0.5, 1.5, truth.shape))
    labels = random.integers(0, len(REGIONS) - 1, truth.shape[:2]).astype(np.uint8)  # nothing in the last
    sums = measured(ctx, programs, picture, truth, labels)
    np.testing.assert_array_equal(sums[:, 3], np.bincount(labels.ravel(), minlength=len(REGIONS)))
    expected = metrics.measure(picture, truth, region_masks(labels), flip=False)
    assert_close(errors_of_sums(sums), expected, tolerance(size[0]))
    assert math.isnan(expected["near_blur"].rmse)


def test_what_is_not_a_number_stays_in_its_region(ctx: moderngl.Context, programs: Programs) -> None:
    picture = np.full((20, 20, 3), 0.5)
    labels = np.zeros((20, 20), np.uint8)
    labels[:, 10:] = 1
    picture[0, 0] = math.nan
    errors = errors_of_sums(measured(ctx, programs, picture, np.full_like(picture, 0.25), labels))
    assert math.isnan(errors["whole"].rmse)
    assert math.isnan(errors["in_focus"].rmse)
    assert errors["far_blur"].rmse == pytest.approx(0.25)


@pytest.fixture(scope="module")
def stage(ctx) -> Stage:
    return half_plane(ctx)


@pytest.fixture
def truth() -> Reference:
    halves = np.random.default_rng(2).uniform(0.0, 1.0, (2, SIZE[1], SIZE[0], 3)).astype(np.float32)
    near, far = np.meshgrid(np.linspace(0, 1, SIZE[0]), np.linspace(0, 1, SIZE[1]))
    return Reference(halves, np.float32(near), np.float32(far))


@pytest.mark.parametrize("view", ["sharp", "post", "hybrid", "traced", "reference"])
def test_the_error_of_a_view_is_read_off_its_own_picture(
    ctx, programs: Programs, stage: Stage, truth: Reference, view: str
) -> None:
    live = LiveError(ctx, programs)
    assert live.latest is None
    assert live.finish() is None
    live.set_reference(truth)
    for number, renderer in enumerate(stage.frames(view, SIZE, [Moment(stage.camera, 0.0)] * 5), 1):
        live.update(renderer)
        assert (live.latest is not None) == (number >= RING), "a figure that is not late would have been waited for"
    assert_close(live.finish(), truth.errors(renderer.linear(), flip=False), tolerance(SIZE[0]))
    assert live.floor is not None
    assert_close(live.floor, truth.errors(truth.halves[0], flip=False), tolerance(SIZE[0]))
    live.release()


def test_what_has_no_error_has_no_figure(ctx, programs: Programs, stage: Stage, truth: Reference) -> None:
    live = LiveError(ctx, programs)
    live.update(stage.draw("post", SIZE))
    assert live.latest is None, "there is no reference"
    live.set_reference(truth)
    live.update(stage.draw("post", SIZE))
    assert live.finish() is not None
    for view, size in (("depth", SIZE), ("post", (32, 18))):
        live.update(stage.draw(view, size))
        assert live.latest is None
        assert live.heat_map(stage.renderer) is None
    live.release()


def test_a_plan_knows_nothing_of_it(ctx, programs: Programs, stage: Stage, truth: Reference) -> None:
    before = stage.draw("post", SIZE, frames=2).picture()
    live = LiveError(ctx, programs)
    live.set_reference(truth)
    for renderer in stage.frames("post", SIZE, [Moment(stage.camera, 0.0)] * 2):
        live.update(renderer)
        live.heat_map(renderer)
    np.testing.assert_array_equal(renderer.picture(), before)
    live.release()


def test_the_heat_map_shows_the_displayed_difference(ctx, programs: Programs, stage: Stage, truth: Reference) -> None:
    live = LiveError(ctx, programs)
    live.set_reference(truth)
    renderer = stage.draw("post", SIZE)
    error = np.sqrt(metrics.squared_errors(renderer.linear(), truth.picture)[2])
    for overlay, (low, high) in ((None, HEAT_RANGE), (Overlay(range_low=0.2, range_high=0.6), (0.2, 0.6))):
        painted = np.frombuffer(live.heat_map(renderer, overlay).read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)
        expected = 255.0 * sequential((error - low) / (high - low))
        # The map's steepest channel rises by less than 4 over its whole range: float32's part of that, and a rounding.
        np.testing.assert_allclose(painted[::-1, :, :3], expected, atol=0.51 + 255 * 4 * PIXEL / (high - low))
    live.release()


def test_every_error_has_a_name() -> None:
    errors = errors_of_sums(np.array([[1.0, 2.0, 4.0, 4.0]] + [[0.0] * 4] * 3))
    assert astuple(errors["whole"])[:2] == (0.5, 0.5)
    assert errors["whole"].psnr == 0.0
    assert math.isnan(errors["near_blur"].psnr)
