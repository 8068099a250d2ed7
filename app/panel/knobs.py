"""Every setting as a widget, drawn from its one definition: range, unit, scale, meaning, and the way to its default."""

from __future__ import annotations

from dataclasses import Field
from enum import Enum
from typing import Any

from imgui_bundle import imgui

from ..settings import Settings, plain, put, walk
from . import style

TITLES = {
    "lens": "Lens",
    "post": "Post-process",
    "mask": "Ray mask",
    "rays": "Ray budget",
    "blend": "Blend thresholds",
    "shading": "Shading and tone",
    "temporal": "Anti-aliasing over time",
    "overlay": "Overlays and viewer range",
}
OPEN_AT_FIRST = ("lens", "rays", "blend")  # what the demo is about; the rest is one click away
LABEL_EM = 9.5  # room for the longest setting's name beside its widget, in font heights


def title(group: str) -> str:
    """A settings group's heading; a new group gets a readable one without a line here."""
    return TITLES.get(group, group.replace("_", " ").capitalize())


def draw_groups(settings: Settings) -> Settings:
    """Draw every group of settings; returns the settings the user now wants."""
    leaves = list(walk(settings))
    for group in dict.fromkeys(path.partition(".")[0] for path, _, _ in leaves):
        flags = imgui.TreeNodeFlags_.default_open if group in OPEN_AT_FIRST else imgui.TreeNodeFlags_.none
        if not imgui.collapsing_header(f"{title(group)}###{group}", flags):
            continue
        for path, leaf, value in leaves:
            if path.startswith(group + "."):
                settings = draw_knob(settings, path, leaf, value)
    return settings


def draw_knob(settings: Settings, path: str, leaf: Field[Any], value: Any) -> Settings:
    """Draw one setting with its tooltip and reset button; returns the settings with the new value."""
    imgui.push_id(path)
    imgui.set_next_item_width(imgui.get_content_region_avail().x - LABEL_EM * imgui.get_font_size())
    changed, new = _widget(leaf.name.replace("_", " "), leaf, value)
    if imgui.begin_item_tooltip():
        _tooltip(path, leaf)
        imgui.end_tooltip()
    if value != leaf.default:
        imgui.same_line(imgui.get_content_region_avail().x - 0.3 * imgui.get_font_size())
        if imgui.small_button("x"):
            changed, new = True, leaf.default
        imgui.set_item_tooltip(f"Back to the default, {describe(leaf.default, leaf.metadata['unit'])}")
    imgui.pop_id()
    return put(settings, path, new) if changed else settings


def describe(value: Any, unit: str) -> str:
    """A value as a person reads it: "0.05 m", "lit", "on"."""
    if isinstance(value, bool):
        return "on" if value else "off"
    text = (
        ", ".join(f"{x:g}" for x in value)
        if isinstance(value, tuple)
        else f"{value:g}"
        if isinstance(value, float)
        else str(plain(value))
    )
    return f"{text} {unit}".strip()


def _widget(label: str, leaf: Field[Any], value: Any) -> tuple[bool, Any]:
    meta = leaf.metadata
    if isinstance(value, bool):
        return imgui.checkbox(label, value)
    if isinstance(value, Enum):
        members = list(type(value))
        changed, index = imgui.combo(label, members.index(value), [member.value for member in members])
        return changed, members[index]
    flags = imgui.SliderFlags_.always_clamp | (imgui.SliderFlags_.logarithmic if meta["log"] else 0)
    if isinstance(value, int):
        return imgui.slider_int(label, value, int(meta["low"]), int(meta["high"]), f"%d {meta['unit']}", flags)
    if isinstance(value, tuple):
        changed, color = imgui.color_edit3(label, list(value), imgui.ColorEditFlags_.float | imgui.ColorEditFlags_.hdr)
        return changed, tuple(min(max(float(x), meta["low"]), meta["high"]) for x in color)
    changed, number = imgui.slider_float(label, value, meta["low"], meta["high"], f"%.4g {meta['unit']}", flags)
    return changed, float(number)


def _tooltip(path: str, leaf: Field[Any]) -> None:
    meta = leaf.metadata
    imgui.push_text_wrap_pos(style.TOOLTIP_EM * imgui.get_font_size())
    imgui.text_unformatted(leaf.metadata["doc"])
    imgui.push_style_color(imgui.Col_.text, style.MUTED)
    if meta["low"] is not None:
        imgui.text_unformatted(
            f"{meta['low']:g} to {describe(meta['high'], meta['unit'])}; Ctrl+click to type a number"
        )
    imgui.text_unformatted(f"--{path}, default {describe(leaf.default, meta['unit'])}")
    if meta["off"] is not None:
        imgui.text_unformatted(f"a step of the technique: off at {describe(meta['off'], meta['unit'])}")
    if meta["quality"]:
        imgui.text_unformatted("trades accuracy for time")
    if meta["static"]:
        imgui.text_unformatted("compiled into the shaders: changing it pauses for a moment")
    imgui.pop_style_color()
    imgui.pop_text_wrap_pos()
