"""The panel's section on cost, without a GPU: it draws whatever is known, and a click on a mark asks for that view."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from imgui_bundle import imgui, implot

from app.measure.candidates import candidates
from app.measure.metrics import Errors
from app.measure.quote import METRICS
from app.measure.regions import REGIONS
from app.measure.survey import Candidate, Findings, Measured
from app.panel.cost import AREAS
from app.panel.input import UiInput
from app.panel.model import HeatShown, Look, Shown, SurveyShown, SurveyWish
from app.panel.panel import Panel
from app.panel.plots import limits, log_ticks
from app.settings import Settings

from .test_panel import SIZE, frame, interface

OPEN = Look(survey=SurveyWish(open=True))
FLOOR = Errors(0.001, 1e-6, 60.0, 0.001)
LISTED = candidates(Settings(), samples=(1, 2, 4))


@pytest.fixture
def ui() -> Iterator[imgui.IO]:
    with interface() as io:
        implot.create_context()
        yield io
        implot.destroy_context()


def regions(errors: Errors) -> dict[str, Errors]:
    return {"whole": errors, **dict.fromkeys(REGIONS, errors)}


def found(index: int) -> Measured:
    """The dearer, the better; no two at one place."""
    error = 0.4 * 0.7**index
    of = Errors(error, error**2, -20 * math.log10(error), error)
    return Measured(
        3.0 * 1.5**index, regions(of), np.zeros((9, 16, 3), np.float32), np.full((9, 16), error, np.float32)
    )


def told(measured: int, floor: Errors | None = FLOOR) -> Shown:
    points = tuple((c, found(i) if i < measured else None) for i, c in enumerate(LISTED))
    own = (Candidate("now", "hybrid", Settings()), found(3) if measured > 3 else None)
    curve = tuple((n, regions(Errors(0.1 / n, 0.01 / n, 20.0 + n))) for n in range(1, measured))
    floors = regions(floor) if floor else None
    return Shown(survey=SurveyShown(Findings((160, 90), points, own, floors, curve, "sharp", 0.5)))


def test_closed_it_asks_for_nothing_and_draws_no_mark(ui: imgui.IO) -> None:
    panel = Panel()
    for _ in range(2):
        look, _ = frame(panel, Look(), told(14))
        assert look == Look()
        assert not panel.cost.places


@pytest.mark.parametrize("measured", [0, 1, 2, 14])
def test_it_draws_whatever_is_known_and_changes_nothing_by_itself(ui: imgui.IO, measured: int) -> None:
    panel = Panel()
    for shown in (Shown(), told(measured, None), told(measured), replace(told(measured), heat=HeatShown())):
        for _ in range(2):
            assert frame(panel, OPEN, shown) == (OPEN, [])
    assert set(panel.cost.places) == {c.label for c in LISTED[:measured]} | ({"now"} if measured > 3 else set())


@pytest.mark.parametrize("metric", METRICS)
def test_every_figure_and_region_draws(ui: imgui.IO, metric: str) -> None:
    panel = Panel()
    for region in AREAS:
        panel.cost._metric, panel.cost._region = metric, region
        wanted = replace(OPEN, survey=replace(OPEN.survey, flip=metric == "flip"))
        assert frame(panel, OPEN, told(14))[0] == wanted
        assert len(panel.cost.places) == 15
        nowhere = Errors(math.nan, math.nan, math.nan, math.nan)
        frame(panel, OPEN, told(14, nowhere))
        assert not panel.cost.places


@pytest.mark.parametrize(("drag", "view"), [(0.0, "post"), (30.0, "hybrid")])
def test_a_click_on_a_mark_asks_for_its_view_and_settings_but_a_drag_moves_the_plot(
    ui: imgui.IO, drag: float, view: str
) -> None:
    panel, look, source = Panel(), OPEN, UiInput()
    for _ in range(2):
        look, _ = frame(panel, look, told(14))
    x, y = panel.cost.places["post, 6 rings"]
    source.pointer(x + 1.0, y)
    for _ in range(3):  # the tooltip with its thumbnail is drawn, too
        look, _ = frame(panel, look, told(14))
    source.button("left", True)
    look, _ = frame(panel, look, told(14))
    if drag:
        source.pointer(x + drag, y)
        look, _ = frame(panel, look, told(14))
    source.button("left", False)
    look, _ = frame(panel, look, told(14))
    assert look.view == view
    assert look.settings.post.rings == (6 if view == "post" else Settings().post.rings)
    assert replace(look, view="hybrid", settings=Settings()) == OPEN


def test_the_plot_keeps_what_was_dragged_until_something_new_is_known(ui: imgui.IO) -> None:
    panel, source = Panel(), UiInput()
    for _ in range(2):
        frame(panel, OPEN, told(14))
    fitted = dict(panel.cost.places)
    x, y = fitted["sharp"]
    source.pointer(x + 60.0, y)
    frame(panel, OPEN, told(14))
    source.button("left", True)
    frame(panel, OPEN, told(14))
    source.pointer(x + 80.0, y)
    for _ in range(2):
        frame(panel, OPEN, told(14))
    source.button("left", False)
    for _ in range(2):
        frame(panel, OPEN, told(14))
    assert panel.cost.places["sharp"][0] == pytest.approx(x + 20.0, abs=2.0)
    for _ in range(2):
        frame(panel, OPEN, told(5))
    for label in panel.cost.places:
        assert panel.cost.places[label][0] > SIZE[0] - panel.width


def test_the_heat_maps_scale_has_numbers_and_the_panel_its_figure(ui: imgui.IO) -> None:
    look = replace(OPEN, heat=True)
    heat = HeatShown(True, 1.0, (0.0, 0.1), regions(Errors(0.1, 0.01, 20.0)), regions(FLOOR))
    for shown in (heat, replace(heat, ready=False, part=0.5), replace(heat, errors=None)):
        assert frame(Panel(), look, replace(told(14), heat=shown)) == (look, [])


def test_axes_show_all_values_and_round_numbers() -> None:
    for values in ([3.0], [3.0, 5.0], [0.01, 100.0]):
        low, high = limits(values, log=True)
        assert low < min(values) <= max(values) < high
        ticks = log_ticks(low, high)
        assert 1 <= len(ticks) <= 6
        assert all(low <= t <= high for t in ticks)
    low, high = limits([20.0, 20.0], log=False)
    assert low < 20.0 < high
    assert limits([], log=False) == (0.0, 1.0)
    assert log_ticks(0.0, 1.0) == []
