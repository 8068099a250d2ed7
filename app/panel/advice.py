"""Advice in the panel: an error or a frame time to keep, a button, and how far the search has got."""

from __future__ import annotations

from imgui_bundle import imgui

from .costs import muted
from .model import Request, Shown

GOALS = (("error", 0.05, "%.4f"), ("ms", 16.0, "%.2f ms"))
TIPS = {
    "error": "The cheapest settings whose picture stays below this error (mean FLIP; RMSE where that is not installed)",
    "ms": "The most accurate settings whose frames take less than this",
}


class AdvicePicker:
    """Remembers what is to be kept, and its limit."""

    def __init__(self) -> None:
        self._goal = 0
        self._limits = [limit for _, limit, _ in GOALS]

    def draw(self, shown: Shown, requests: list[Request]) -> None:
        """Draw the choice and its button; what the user wants is added to `requests`."""
        for index, (name, _, _) in enumerate(GOALS):
            if imgui.radio_button(name, self._goal == index):
                self._goal = index
            imgui.set_item_tooltip(TIPS[name])
            imgui.same_line()
        imgui.new_line()
        name, _, text = GOALS[self._goal]
        imgui.set_next_item_width(imgui.get_content_region_avail().x - 6.0 * imgui.get_font_size())
        _, self._limits[self._goal] = imgui.input_float(f"##{name}", self._limits[self._goal], format=text)
        imgui.same_line()
        if imgui.button("Stop" if shown.advising else "Advise...", imgui.ImVec2(-1.0, 0.0)):
            limit = self._limits[self._goal]
            requests.append(Request("stop advice") if shown.advising else Request("advise", name, number=limit))
        imgui.set_item_tooltip(
            "Tries the settings that trade accuracy for time, in every view, as this picture stands still"
        )
        if shown.advice:
            muted(shown.advice)
