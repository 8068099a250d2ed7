"""The panel's list of passes: figures, order, and the flash of what changed."""

from __future__ import annotations

from dataclasses import replace

import pytest
from imgui_bundle import imgui

from app.frame.pipeline import frame_plan
from app.panel.effects import FLASH_S, EffectsSection, rows_of
from app.panel.model import Cost, Request, Shown
from app.scene.facts import Facts
from app.settings import Settings

from .test_panel import interface

BLURRED = frame_plan("hybrid", Settings(), Facts(near_coc_px=30.0, far_coc_px=40.0))
SHARP = frame_plan("hybrid", Settings(), Facts(near_coc_px=0.0, far_coc_px=0.0))


def shown(plan: object, **values: object) -> Shown:
    cost = Cost("hybrid", plan, (("gbuffer", 2.0),), before={"gather": 3.0, "post": 4.0})  # type: ignore[arg-type]
    return replace(Shown(), costs=(cost,), **values)


def test_what_runs_has_its_cost_and_what_does_not_its_saving() -> None:
    what = shown(SHARP, full_ms={"post": 5.0})
    rows = {row.name: row for row in rows_of(what.costs[0], what)}
    assert rows["gbuffer"].figure == "2.00 ms"
    assert rows["lighting"].figure == "", "not measured yet"
    assert rows["gather"].figure == "-3.00 ms", "when it last ran"
    assert rows["post"].figure == "-5.00 ms", "measured for this picture: rather than what was before"
    assert rows["trace"].figure == ""
    assert all(row.reason for row in rows.values())
    names = [row.name for row in rows_of(what.costs[0], what) if row.runs]
    assert names == [call.step.name for call in SHARP.calls]


@pytest.mark.parametrize("closed", [True, False])
def test_what_changes_flashes_and_fades(closed: bool) -> None:
    with interface() as io:
        section, asked = EffectsSection(), list[Request]()

        def draw(plan: object) -> bool:
            imgui.new_frame()
            imgui.begin("panel")
            imgui.set_next_item_open(not closed)
            section.draw(shown(plan), asked)
            imgui.end()
            imgui.render()
            return section.fading

        assert not draw(BLURRED), "the first frame changes nothing"
        assert not draw(BLURRED)
        assert draw(SHARP)
        io.delta_time = 0.9 * FLASH_S
        assert draw(SHARP)
        assert not draw(SHARP)
        assert draw(BLURRED)
        assert asked == []


def test_an_open_list_draws_with_what_is_being_measured() -> None:
    with interface():
        section = EffectsSection()
        for part in (None, 0.5):
            imgui.new_frame()
            imgui.set_next_window_size(imgui.ImVec2(600.0, 4000.0))
            imgui.begin("panel")
            imgui.set_next_item_open(True)
            section.draw(shown(BLURRED, measuring=part), [])
            imgui.end()
            imgui.render()


def test_the_pointer_over_a_row_tells_what_its_pass_is_for(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr("app.panel.effects._tell", told.append)
    with interface() as io:
        section = EffectsSection()
        for y in range(0, 1200, 7):
            io.add_mouse_pos_event(100.0, float(y))
            imgui.new_frame()
            imgui.set_next_window_pos(imgui.ImVec2(0.0, 0.0))
            imgui.set_next_window_size(imgui.ImVec2(400.0, 1200.0))
            imgui.begin("panel")
            imgui.set_next_item_open(True)
            section.draw(shown(BLURRED), [])
            imgui.end()
            imgui.render()
    names = list(dict.fromkeys(text.partition(":")[0] for text in told))
    assert names == [row.name for row in rows_of(shown(BLURRED).costs[0], shown(BLURRED))]
    assert next(text for text in told if text.startswith("coc")).startswith("coc: Turns depth into")


def test_a_reason_is_told_once_for_passes_in_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr("app.panel.effects.muted", told.append)
    with interface():
        imgui.new_frame()
        imgui.begin("panel")
        imgui.set_next_item_open(True)
        EffectsSection().draw(shown(BLURRED), [])
        imgui.end()
        imgui.render()
    rows = rows_of(shown(BLURRED).costs[0], shown(BLURRED))
    assert len(told) == len(rows)
    last = ""
    for text, row in zip(told, rows, strict=True):
        assert text == ("as above" if row.why == last else row.why)
        last = row.why
