"""Figures are never quoted below the reference's noise, and what is worth having follows from them."""

from __future__ import annotations

import math

import pytest

from app.measure.metrics import Errors, rmse
from app.measure.quote import METRICS, Priced, badness, best, clearly_better, independent, quoted, worth

FLOOR = Errors(rmse=0.01, relative_mse=0.001, psnr=40.0, flip=0.02)


@pytest.mark.parametrize("metric", METRICS)
def test_nothing_is_quoted_better_than_the_reference_knows(metric: str) -> None:
    noise = getattr(FLOOR, metric)
    perfect, bad = Errors(0.0, 0.0, math.inf, 0.0), Errors(0.5, 0.5, 6.0, 0.5)
    assert quoted(perfect, FLOOR, metric) == quoted(FLOOR, FLOOR, metric) == (noise, True)
    assert quoted(bad, FLOOR, metric) == (getattr(bad, metric), False)
    assert badness(noise, metric) < badness(getattr(bad, metric), metric)


def test_what_was_not_measured_is_not_quoted() -> None:
    figure, at_floor = quoted(Errors(0.1, 0.1, 20.0), FLOOR, "flip")
    assert math.isnan(figure)
    assert not at_floor


@pytest.mark.parametrize("metric", ["rmse", "relative_mse", "psnr"])
def test_the_slope_is_that_of_a_quarter_of_the_squared_error(metric: str) -> None:
    """Four times the frames, half the error: each figure says so in its own way."""
    first, fourth = (Errors(e, e * e, -20 * math.log10(e)) for e in (0.2, 0.1))
    assert independent(getattr(first, metric), 4, metric) == pytest.approx(getattr(fourth, metric))
    assert first.rmse == pytest.approx(rmse([[[0.2] * 3]], [[[0.0] * 3]]))


def test_what_time_buys_is_told_from_those_worth_having() -> None:
    sharp, post, waste = Priced("sharp", 1.0, 20.0), Priced("post", 3.0, 25.0), Priced("waste", 5.0, 22.0)
    hybrid, traced = Priced("hybrid", 8.0, 28.0), Priced("traced", 20.0, 33.0)
    points = [traced, waste, sharp, hybrid, post]
    assert best(points, "psnr") == [sharp, post, hybrid, traced]
    assert best(points, "rmse") == [sharp]  # the same numbers as an error: the cheapest is the best
    assert worth(hybrid, points, "psnr") == (traced, post)
    assert worth(waste, points, "psnr") == (post, post)  # cheaper and better at once
    assert worth(sharp, points, "psnr") == (post, None)
    assert worth(traced, points, "psnr") == (None, hybrid)
    assert worth(Priced("now", 8.5, 27.99), points, "psnr") == (traced, hybrid), "a hundredth of a decibel is no gain"


@pytest.mark.parametrize("metric", METRICS)
def test_a_hundredth_of_the_error_is_the_least_that_counts(metric: str) -> None:
    of = [Errors(e, e * e, -20 * math.log10(e), e) for e in (0.1, 0.0995, 0.0985)]
    base, less, better = (float(getattr(e, metric)) for e in of)
    assert not clearly_better(less, base, metric)
    assert clearly_better(better, base, metric)
