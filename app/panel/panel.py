"""The panel beside the picture: views, scene, every setting, costs and reasons.

It replaces the Look and utters Requests; it does nothing itself.
"""

from __future__ import annotations

import math
from dataclasses import replace

from imgui_bundle import imgui

from ..frame.pipeline import CONVERGING
from ..scene.validate import count
from . import style
from .advice import AdvicePicker
from .cost import CostSection
from .costs import draw_costs, muted
from .effects import EffectsSection
from .knobs import draw_groups
from .model import Look, Request, Shown
from .overlay import Rect, draw_overlays
from .preset_files import PresetPicker
from .scenes import ScenePicker
from .views import draw_views

WIDTH_EM = 24.0  # of the panel at first, in font heights: a slider, its name and its reset button
MIN_EM = 15.0
MAX_SHARE = 0.6  # of the window: the picture stays


def first_width(density: float) -> float:
    """The panel's width [window units] before the user drags its edge."""
    return WIDTH_EM * style.FONT_PX * density


class Panel:
    """Draws one user interface frame after another."""

    def __init__(self) -> None:
        self._scenes, self._presets, self._advice = ScenePicker(), PresetPicker(), AdvicePicker()
        self.cost, self.effects = CostSection(), EffectsSection()
        self.width = 0.0  # window units, as last drawn; 0 while hidden
        self._roomy = 0.0  # the same, when the window last had room for more: what the user wants
        self._size: tuple[float, float] | None = None  # of the window, as last drawn

    def draw(self, look: Look, shown: Shown, size: tuple[float, float]) -> tuple[Look, list[Request]]:
        """Draw into a window of `size` [window units]; returns what the user wants, and what only the window can do."""
        requests: list[Request] = []
        if look.panel:
            look = self._side(look, shown, size, requests)
        else:
            self.width = 0.0
        draw_overlays(look, shown, self.picture(size))
        return look, requests

    def picture(self, size: tuple[float, float]) -> Rect:
        """Where the picture lies: the window without the panel, in window units from the top left."""
        return 0.0, 0.0, max(size[0] - self.width, 1.0), max(size[1], 1.0)

    def _side(self, look: Look, shown: Shown, size: tuple[float, float], requests: list[Request]) -> Look:
        em = imgui.get_font_size()
        widest = max(MAX_SHARE * size[0], 1.0)
        imgui.set_next_window_pos(imgui.ImVec2(size[0], 0.0), imgui.Cond_.always, imgui.ImVec2(1.0, 0.0))
        imgui.set_next_window_size(imgui.ImVec2(WIDTH_EM * em, size[1]), imgui.Cond_.first_use_ever)
        imgui.set_next_window_size_constraints(
            imgui.ImVec2(min(MIN_EM * em, widest), size[1]), imgui.ImVec2(widest, size[1])
        )
        if self._roomy and size != self._size:  # else one that was squeezed for a while would stay so
            imgui.set_next_window_size(imgui.ImVec2(self._roomy, size[1]), imgui.Cond_.always)
        self._size = size
        fixed = imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_title_bar
        imgui.begin("panel", None, fixed)
        self.width = imgui.get_window_width()
        if self.width < math.floor(widest):  # ImGui cuts off fractions
            self._roomy = self.width
        look = self._sections(look, shown, requests)
        imgui.end()
        return look

    def _sections(self, look: Look, shown: Shown, requests: list[Request]) -> Look:
        opened = imgui.TreeNodeFlags_.default_open
        self._toolbar(shown, requests)
        if shown.shader_error:
            style.wrapped(f"Shader not reloaded, the last good one goes on:\n{shown.shader_error}", style.ERROR)
        if imgui.collapsing_header("View", opened):
            look = draw_views(look, requests)
        if imgui.collapsing_header("Scene", opened):
            self._scenes.draw(shown, requests)
        if imgui.collapsing_header("Preset"):
            self._presets.draw(requests)
        if shown.preset_error:  # also of a file that was dropped
            style.wrapped(shown.preset_error, style.ERROR)
        if imgui.collapsing_header("Advice"):
            self._advice.draw(shown, requests)
        look = self.cost.draw(look, shown)
        look = replace(look, settings=draw_groups(look.settings))
        if imgui.collapsing_header("Milliseconds", opened):
            draw_costs(shown)
        self.effects.draw(shown, requests)
        return look

    def _toolbar(self, shown: Shown, requests: list[Request]) -> None:
        for label, wish, tip in (
            ("Screenshot", "screenshot", "Save a PNG with its settings (F12)"),
            ("Reload shaders", "reload", "Re-read the shader files; a broken one keeps its last good version (F5)"),
        ):
            if imgui.button(label):
                requests.append(Request(wish))  # type: ignore[arg-type]
            imgui.set_item_tooltip(tip)
            imgui.same_line()
        muted("F1: help")
        for cost in shown.costs:
            resting = ", resting" if cost.limit and cost.samples >= cost.limit else ""
            unit = "sample" if cost.view in CONVERGING else "frame"
            muted(f"{cost.view}: {count(cost.samples, unit)}{resting}")
        if shown.preparing:
            what, part = shown.preparing
            imgui.progress_bar(part, imgui.ImVec2(-1.0, 0.0), what)
        muted(f"fly speed {shown.speed:.3g} m/s")
        if shown.motion:
            playing, time_s = shown.motion
            muted(f"motion {'plays' if playing else 'paused'} at {time_s:.1f} s (P)")
