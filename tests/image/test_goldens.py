"""Each picture of a built-in scene is the one that was approved. Only `make approve` writes to screenshots/."""

from __future__ import annotations

import numpy as np
import pytest

from . import goldens
from .goldens import COMPOSED, GOLDENS, SCREENSHOTS, Composed, Golden, Tolerance


@pytest.mark.parametrize("golden", GOLDENS, ids=lambda golden: golden.name)
def test_picture_is_the_approved_one(ctx, golden: Golden) -> None:
    picture, _ = goldens.render(ctx, golden)
    goldens.assert_golden(golden.name, picture, golden.tolerance)


@pytest.mark.parametrize("composed", COMPOSED, ids=lambda composed: composed.name)
def test_composed_picture_shows_the_approved_ones(composed: Composed) -> None:
    parts = [goldens.stored(part) for part in composed.parts]
    assert all(part is not None for part in parts)
    goldens.assert_golden(composed.name, composed.compose([p for p in parts if p is not None]), composed.tolerance)


def test_every_screenshot_can_be_drawn_again() -> None:
    assert {path.stem for path in SCREENSHOTS.glob("*.png")} == {golden.name for golden in (*GOLDENS, *COMPOSED)}


@pytest.mark.parametrize(
    ("one", "other"), [("post", "sharp"), ("hybrid", "post"), ("traced", "hybrid"), ("coc", "mask")]
)
def test_tolerance_tells_the_views_apart(one: str, other: str) -> None:
    expected, actual = goldens.stored(one), goldens.stored(other)
    assert expected is not None
    assert actual is not None
    allowed = next(golden.tolerance for golden in GOLDENS if golden.name == one)
    assert not goldens.within(goldens.difference(expected, actual), allowed)


def test_a_failure_says_what_differs_and_shows_it(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(goldens, "SCREENSHOTS", tmp_path)
    monkeypatch.setattr(goldens, "DIFFERENCES", tmp_path / "diff")
    expected = np.zeros((4, 5, 3), np.uint8)
    goldens.Image.fromarray(expected).save(tmp_path / "x.png")
    goldens.assert_golden("x", expected + np.uint8(goldens.LEVELS), Tolerance(0.0, 3.0))
    with pytest.raises(AssertionError, match=r"100\.00% of the pixels differ .* see .*x\.png"):
        goldens.assert_golden("x", expected + np.uint8(goldens.LEVELS + 1), Tolerance(0.5, 9.0))
    shown = np.asarray(goldens.Image.open(tmp_path / "diff" / "x.png"))
    assert shown.shape == (4, 15, 3)
    assert (shown[:, 10:] == (goldens.LEVELS + 1) * goldens.AMPLIFIED).all()
