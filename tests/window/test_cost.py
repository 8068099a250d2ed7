"""The Cost section in a real window: opened by its key, filled in by itself, a point applied by a click."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import Driver, seen

LABEL = "post, 3 rings"


@pytest.fixture(scope="module")
def roomy(display: str, scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driver]:
    """A window high enough for the plot."""
    with Driver(display, tmp_path_factory.mktemp("cost"), *seen(scene), "--view", "sharp") as driver:
        wide, _ = driver.state["window"]
        driver.do("windowsize", driver.window, str(wide), "620")
        driver.wait(lambda s: s["size"][1] == 620)
        yield driver


def test_points_appear_and_a_click_on_one_applies_it(roomy: Driver) -> None:
    assert roomy.state["survey"] is None
    roomy.key("m")
    roomy.wait(lambda s: "post, 4 rings" in s["marks"])
    before = roomy.state["marks"][LABEL]
    roomy.do("mousemove", *map(str, before), "sleep", "0.5")
    at = roomy.wait(lambda s: LABEL in s["marks"])["marks"][LABEL]  # nothing is measured while the mouse moves
    roomy.do("mousemove", *map(str, at), "click", "1")
    state = roomy.wait(lambda s: s["view"] == "post")
    assert state["survey"]["measured"] >= 4, "what was measured stays"


def test_the_map_comes_over_the_picture_and_goes(roomy: Driver) -> None:
    roomy.do("mousemove", "20", "20")
    roomy.key("h")
    roomy.wait(lambda s: s["heat"])
    roomy.key("h")
    roomy.wait(lambda s: not s["heat"])


def test_closed_it_measures_nothing(roomy: Driver) -> None:
    roomy.key("m")
    roomy.wait(lambda s: s["survey"] is None and not s["marks"])
