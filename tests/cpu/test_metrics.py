"""Errors mean what other libraries mean by them, over the whole picture and over its parts."""

from __future__ import annotations

import math
import sys

import flip_evaluator
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from skimage import metrics as skimage

from app.errors import UserError
from app.measure import metrics
from app.measure.metrics import RELATIVE_EPSILON, Errors, measure
from app.measure.reference import Reference
from app.measure.regions import BOTH_SIDES, REGIONS, focus_zone_m, region_labels, region_masks
from app.optics import IN_FOCUS_COC_PX, coc_px, coc_scale_px
from app.settings import Lens

RANDOM = np.random.default_rng(7)
SHAPE = (36, 64, 3)
TRUTH = RANDOM.uniform(0.0, 2.0, SHAPE)  # half of it brighter than a display
PICTURE = np.abs(TRUTH + RANDOM.normal(0.0, 0.1, SHAPE))
LEFT = np.broadcast_to(np.arange(64) < 20, (36, 64))


def test_they_agree_with_scikit_image() -> None:
    assert metrics.rmse(PICTURE, TRUTH) == pytest.approx(math.sqrt(skimage.mean_squared_error(TRUTH, PICTURE)))
    shown = metrics.shown(TRUTH), metrics.shown(PICTURE)
    assert metrics.psnr(PICTURE, TRUTH) == pytest.approx(skimage.peak_signal_noise_ratio(*shown, data_range=1.0))


def test_flip_is_its_authors() -> None:
    shown = [np.float32(metrics.shown(p)) for p in (TRUTH, PICTURE)]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR")
    assert metrics.mean_flip(TRUTH, PICTURE) == pytest.approx(mean, rel=1e-5)  # theirs is summed in float32


def test_a_known_difference_has_known_errors() -> None:
    truth = np.full(SHAPE, 0.2)
    errors = measure(truth + 0.1, truth, flip=False)["whole"]
    assert errors.rmse == pytest.approx(0.1)
    assert errors.relative_mse == pytest.approx(0.01 / (0.04 + RELATIVE_EPSILON))
    difference = 1.055 * (0.3 ** (1 / 2.4) - 0.2 ** (1 / 2.4))
    assert errors.psnr == pytest.approx(-20 * math.log10(difference))
    assert math.isnan(errors.flip)


def test_equal_pictures_have_no_error() -> None:
    assert measure(TRUTH, TRUTH)["whole"] == Errors(0.0, 0.0, math.inf, 0.0)
    brighter = measure(TRUTH + 1.0, TRUTH + 2.0)["whole"]
    assert brighter.psnr == math.inf, "both are white on the display"
    assert brighter.flip == 0.0
    assert brighter.rmse == pytest.approx(1.0)


@pytest.mark.parametrize("deviation", [0.001, 0.1])
def test_the_error_of_gaussian_noise_is_its_deviation(deviation: float) -> None:
    noisy = TRUTH + np.random.default_rng(11).normal(0.0, deviation, SHAPE)
    # The mean square of n normal numbers has the relative deviation sqrt(2 / n), its root half of that; five of them.
    tolerance = 5 * math.sqrt(0.5 / TRUTH.size)
    assert metrics.rmse(noisy, TRUTH) == pytest.approx(deviation, rel=tolerance)
    weights = 1.0 / (TRUTH**2 + RELATIVE_EPSILON)
    spread = 5 * math.sqrt(2 * np.sum(weights**2)) / np.sum(weights)
    assert metrics.relative_mse(noisy, TRUTH) == pytest.approx(deviation**2 * weights.mean(), rel=spread)


def test_the_whole_is_the_sum_of_its_parts() -> None:
    parts = {"left": LEFT, "right": ~LEFT}
    measured = measure(PICTURE, TRUTH, parts)
    assert list(measured) == ["whole", "left", "right"]
    for value in (lambda e: e.rmse**2, lambda e: e.relative_mse, lambda e: 10 ** (-e.psnr / 10), lambda e: e.flip):
        of_parts = sum(value(measured[name]) * region.mean() for name, region in parts.items())
        assert value(measured["whole"]) == pytest.approx(of_parts, rel=1e-12)
    assert metrics.rmse(PICTURE, TRUTH, LEFT) == measured["left"].rmse
    assert metrics.psnr(PICTURE, TRUTH, LEFT) == measured["left"].psnr
    assert metrics.relative_mse(PICTURE, TRUTH, LEFT) == measured["left"].relative_mse
    assert metrics.mean_flip(TRUTH, PICTURE, LEFT) == measured["left"].flip


def test_an_empty_region_has_no_figures() -> None:
    errors = measure(PICTURE, TRUTH, {"none": np.zeros(SHAPE[:2], bool)})["none"]
    assert all(math.isnan(value) for value in vars(errors).values())


def test_what_is_not_a_number_is_not_hidden() -> None:
    broken = PICTURE.copy()
    broken[0, 0, 0] = math.nan
    measured = measure(broken, TRUTH, {"left": LEFT, "right": ~LEFT}, flip=False)
    assert math.isnan(measured["whole"].rmse)
    assert math.isnan(measured["left"].psnr)
    assert math.isfinite(measured["right"].rmse)


@pytest.mark.parametrize("other", [np.zeros((36, 32, 3)), np.zeros((36, 64)), np.zeros((36, 64, 4))])
def test_pictures_that_cannot_be_compared_are_refused(other: np.ndarray) -> None:
    with pytest.raises(UserError, match="to compare"):
        measure(other, TRUTH)


def test_without_the_extra_only_flip_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    with pytest.raises(UserError, match=r"hybrid-dof\[metrics\]"):
        metrics.flip_map(TRUTH, PICTURE)
    errors = measure(PICTURE, TRUTH)["whole"]
    assert math.isnan(errors.flip)
    assert errors.rmse > 0.0


SHARES = arrays(np.float32, (2, 4, 5), elements=st.floats(0.0, 1.0, width=32))


@given(shares=SHARES)
def test_every_pixel_is_in_one_region(shares: np.ndarray) -> None:
    near, far = shares[0], shares[1] * (1.0 - shares[0])
    masks = region_masks(region_labels(near, far))
    assert list(masks) == list(REGIONS)
    np.testing.assert_array_equal(sum(mask.astype(int) for mask in masks.values()), 1)
    hardly, nearly_all = BOTH_SIDES
    np.testing.assert_array_equal(masks["near_silhouettes"], (near > hardly) & (near < nearly_all))
    np.testing.assert_array_equal(masks["near_blur"], near >= nearly_all)
    np.testing.assert_array_equal(masks["in_focus"] | masks["far_blur"], near <= hardly)
    assert (far[masks["in_focus"]] <= hardly).all()
    assert (far[masks["far_blur"]] > hardly).all()


@given(aperture=st.floats(0.0, 1.0), focus=st.floats(0.1, 1e4), height=st.integers(8, 4320))
def test_the_focus_zone_ends_where_blur_is_seen(aperture: float, focus: float, height: int) -> None:
    near, far = focus_zone_m(Lens(aperture=aperture, focus_distance=focus), height, 0.7)
    assert near <= focus <= far
    scale = coc_scale_px(aperture, height, 0.7)
    if near > 1e-6:  # and K is not 0
        assert coc_px(near, scale, 1.0 / focus) == pytest.approx(-IN_FOCUS_COC_PX, rel=1e-6)
    if far < np.inf:
        # the far end is 1 over a difference: as far as the difference has digits
        assert coc_px(far, scale, 1.0 / focus) == pytest.approx(IN_FOCUS_COC_PX, rel=1e-6)


def test_the_floor_is_what_the_truth_would_show() -> None:
    """Synthetic noise on a known truth: the floor, measured from two halves, is the reference's error against it."""
    random, deviation = np.random.default_rng(5), 0.02
    truth = np.float32(random.uniform(0.1, 0.9, (120, 160, 3)))
    halves = np.float32(truth + random.normal(0.0, deviation, (2, *truth.shape)))
    nothing = np.zeros(truth.shape[:2], np.float32)
    reference = Reference(halves, nothing, nothing)
    actual, floor = reference.errors(truth), reference.floor
    assert floor["whole"].rmse == pytest.approx(deviation / math.sqrt(2), rel=5 * math.sqrt(0.5 / truth.size))
    # Floor and error are of two independent draws of the same noise, of n numbers each.
    tolerance = 5 * math.sqrt(2) * math.sqrt(0.5 / truth.size)
    for region in ("whole", "in_focus"):
        assert floor[region].rmse == pytest.approx(actual[region].rmse, rel=tolerance)
        assert floor[region].psnr == pytest.approx(actual[region].psnr, abs=20 * math.log10(1 + tolerance))
        assert floor[region].relative_mse == pytest.approx(actual[region].relative_mse, rel=4 * tolerance)
        assert floor[region].flip == pytest.approx(actual[region].flip, rel=tolerance)
    assert math.isnan(floor["near_blur"].rmse)


def test_halves_that_agree_have_no_floor() -> None:
    half = RANDOM.uniform(0.0, 1.0, SHAPE).astype(np.float32)
    nothing = np.zeros(SHAPE[:2], np.float32)
    reference = Reference(np.stack([half, half]), nothing, nothing)
    assert reference.floor["whole"] == Errors(0.0, 0.0, math.inf, 0.0)
    np.testing.assert_array_equal(reference.picture, half)
    assert reference.size == (64, 36)
