"""Choosing what is looked at: a view, any intermediate target with the legend of its colours, or two side by side."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from imgui_bundle import imgui

from ..controls import BINDINGS
from ..frame.pipeline import VIEWABLE, VIEWS
from ..frame.records import Target
from ..frame.targets import TARGETS
from ..settings import Settings, put, walk
from . import style
from .colormap import diverging, sequential, signed_unit, wheel
from .costs import muted
from .knobs import LABEL_EM, draw_knob
from .model import Look, Request

SCALES = (1.0, 0.75, 0.5, 0.25)
LEGEND_STEPS = 48  # colour samples along the bar: finer than the eye tells apart at its width


def draw_views(look: Look, requests: list[Request]) -> Look:
    """View buttons, target viewer, split screen and resolution; returns what the user now wants to see."""
    look = replace(look, view=_view_buttons(look.view))
    look = replace(look, view=_combo("target", "target", look.view, "a view, not a target"))
    changed, compare = imgui.checkbox("split screen with", look.compare)
    imgui.set_item_tooltip("Two views of the same moment; drag the bar in the picture (key C)")
    if changed:
        look = replace(look, compare=compare)
    if look.compare:
        imgui.same_line()
        imgui.set_next_item_width(-1.0)
        look = replace(look, other=_combo("##other", "other", look.other, "", tuple(VIEWS) + VIEWABLE))
    names = [f"{100 * s:g} %" for s in SCALES]
    imgui.set_next_item_width(imgui.get_content_region_avail().x - LABEL_EM * imgui.get_font_size())
    changed, index = imgui.combo("resolution", SCALES.index(look.scale), names)
    imgui.set_item_tooltip("Picture pixels per window pixel: lower is faster and coarser")
    if changed:
        look = replace(look, scale=SCALES[index])
    shown = [name for name in dict.fromkeys((look.view, *((look.other,) if look.compare else ()))) if name in VIEWABLE]
    for name in shown:
        draw_legend(TARGETS[name], look.settings)
    if any(TARGETS[name].show in ("signed", "scalar", "vector") for name in shown):
        look = replace(look, settings=_range(look.settings, requests))
    return look


def value_range(target: Target, settings: Settings) -> tuple[float, float]:
    """The colour map's ends: the settings', or the target's own where those coincide."""
    low, high = settings.overlay.range_low, settings.overlay.range_high
    return (low, high) if low != high else target.range


def legend_colors(target: Target, low: float, high: float) -> np.ndarray:
    """(LEGEND_STEPS, 3) display colours from `low` to `high`, as glsl/output/show.comp paints them."""
    values = np.linspace(low, high, LEGEND_STEPS)
    if target.show == "signed":
        return diverging(signed_unit(values, low, high))
    if target.show == "vector":
        angle = np.linspace(-np.pi, np.pi, LEGEND_STEPS)
        return wheel(np.cos(angle), np.sin(angle))
    return sequential((values - low) / max(high - low, 1e-30))


def draw_legend(target: Target, settings: Settings) -> None:
    """Name, meaning and colour bar of one target."""
    imgui.separator_text(target.name)
    muted(target.meaning + ("" if target.scale == 1 else f" (1/{target.scale} of full resolution)"))
    low, high = value_range(target, settings)
    if target.show == "color":
        muted("shown as a colour: exposure and sRGB, no tone curve")
    elif target.show == "normal":
        muted("red, green, blue: x, y, z from -1 to 1; black: sky")
    else:
        draw_bar(legend_colors(target, low, high))
        middle = {"vector": "hue: direction", "signed": "0"}.get(target.show, f"{(low + high) / 2:.4g}")
        draw_ticks(*(("left", middle, "left") if target.show == "vector" else (f"{low:.4g}", middle, f"{high:.4g}")))
        if target.show == "vector":
            muted(f"brightness: length, full at {high:.4g} px; red points right, cyan left")
    muted("magenta: not a number, or infinite")


def _view_buttons(current: str) -> str:
    keys = {b.action.removeprefix("view "): b.label for b in BINDINGS if b.action.startswith("view ")}
    width = (imgui.get_content_region_avail().x - (len(VIEWS) - 1) * imgui.get_style().item_spacing.x) / len(VIEWS)
    for index, (name, meaning) in enumerate(VIEWS.items()):
        if index:
            imgui.same_line()
        chosen = name == current
        imgui.push_style_color(
            imgui.Col_.button, style.ACCENT if chosen else imgui.get_style_color_vec4(imgui.Col_.button)
        )
        imgui.push_style_color(
            imgui.Col_.text,
            imgui.ImVec4(0.05, 0.06, 0.07, 1.0) if chosen else imgui.get_style_color_vec4(imgui.Col_.text),
        )
        if imgui.button(name, imgui.ImVec2(width, 0.0)):
            current = name
        imgui.pop_style_color(2)
        imgui.set_item_tooltip(f"{meaning} (key {keys[name]})" if name in keys else meaning)
    return current


def _combo(label: str, what: str, current: str, none: str, names: tuple[str, ...] = VIEWABLE) -> str:
    if not label.startswith("##"):
        imgui.set_next_item_width(imgui.get_content_region_avail().x - LABEL_EM * imgui.get_font_size())
    if imgui.begin_combo(label, current if current in names else none, imgui.ComboFlags_.height_large):
        for name in names:
            if imgui.selectable(f"{name}##{what}", name == current)[0]:
                current = name
            imgui.set_item_tooltip(VIEWS[name] if name in VIEWS else TARGETS[name].meaning)
        imgui.end_combo()
    elif what == "target":
        imgui.set_item_tooltip("Look at any buffer of the frame; only the passes it needs are run")
    return current


def _range(settings: Settings, requests: list[Request]) -> Settings:
    imgui.push_id("viewer")
    for path, leaf, value in walk(settings):
        if path in ("overlay.range_low", "overlay.range_high"):
            settings = draw_knob(settings, path, leaf, value)
    imgui.pop_id()
    if imgui.button("Fit to picture"):
        requests.append(Request("fit range"))
    imgui.set_item_tooltip("Set the range to the 1st and 99th percentile of the values shown now")
    imgui.same_line()
    if imgui.button("Own range"):
        settings = put(put(settings, "overlay.range_low", 0.0), "overlay.range_high", 0.0)
    imgui.set_item_tooltip("Back to the range that the table of targets gives")
    return settings


def draw_bar(colors: np.ndarray) -> None:
    """Colours from left to right over the width there is."""
    drawing, corner = imgui.get_window_draw_list(), imgui.get_cursor_screen_pos()
    width, height = imgui.get_content_region_avail().x, imgui.get_font_size()
    packed = [imgui.color_convert_float4_to_u32(imgui.ImVec4(float(r), float(g), float(b), 1.0)) for r, g, b in colors]
    step = width / (len(packed) - 1)
    for i, (a, b) in enumerate(pairwise(packed)):
        low, high = (
            imgui.ImVec2(corner.x + i * step, corner.y),
            imgui.ImVec2(corner.x + (i + 1) * step, corner.y + height),
        )
        drawing.add_rect_filled_multi_color(low, high, a, b, b, a)
    imgui.dummy(imgui.ImVec2(width, height))


def draw_ticks(low: str, middle: str, high: str) -> None:
    """What a bar's ends and middle mean."""
    width, left = imgui.get_content_region_avail().x, imgui.get_cursor_pos_x()
    imgui.text_unformatted(low)
    imgui.same_line(left + (width - imgui.calc_text_size(middle).x) / 2)
    imgui.text_unformatted(middle)
    imgui.same_line(left + width - imgui.calc_text_size(high).x)
    imgui.text_unformatted(high)
