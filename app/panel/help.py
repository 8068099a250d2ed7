"""The key table over the picture: in as many columns as fit, and within the window, whatever its size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from imgui_bundle import imgui

from ..controls import BINDINGS, Binding
from . import style

Rect = tuple[float, float, float, float]  # x, y from the top left, width, height; window units
Columns = tuple[tuple[str, ...], ...]  # groups of keys, one below the other

_WINDOW = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.no_nav
)
GAP_EM = 2.0  # between two columns, in font heights


@dataclass(frozen=True)
class Layout:
    """Where the help stands: its columns, and its window within `place`."""

    columns: Columns
    place: Rect
    width: float
    height: float
    whole: bool  # else its lines are wrapped, and it scrolls


def draw_help(picture: Rect) -> None:
    """The key table over the picture, or over the whole window where the picture is too small. Where that is as well,
    its lines are wrapped and it scrolls.
    """
    groups = {binding.group: [b for b in BINDINGS if b.group == binding.group] for binding in BINDINGS}
    sizes = {name: _size(bindings) for name, bindings in groups.items()}
    display, style_ = imgui.get_io().display_size, imgui.get_style()
    found = layout(
        sizes,
        [picture, (0.0, 0.0, display.x, display.y)],
        GAP_EM * imgui.get_font_size(),
        style_.item_spacing.y,
        (2.0 * style_.window_padding.x, 2.0 * style_.window_padding.y),
        style_.scrollbar_size,
    )
    x, y, width, height = found.place
    imgui.set_next_window_pos(imgui.ImVec2(x + (width - found.width) / 2, y + (height - found.height) / 2))
    imgui.set_next_window_size(imgui.ImVec2(found.width, found.height))
    imgui.set_next_window_bg_alpha(0.95)
    imgui.begin("##help", None, _WINDOW)
    for index, names in enumerate(found.columns):
        if index:
            imgui.same_line(0.0, GAP_EM * imgui.get_font_size())
        imgui.begin_group()
        for name in names:
            _draw_group(groups[name], wraps=not found.whole)
        imgui.end_group()
    imgui.end()


def layout(
    sizes: dict[str, tuple[float, float]],
    places: Sequence[Rect],
    gap: float,
    spacing: float,
    padding: tuple[float, float],
    scrollbar: float,
) -> Layout:
    """The widest arrangement of groups of such `sizes` (width, height) that fits the first place that one fits; else a
    single column that scrolls, in the first place wide enough, or in the last. `padding`: of the window, both sides
    together.
    """
    names = tuple(sizes)
    splits: list[Columns] = [tuple((name,) for name in names), (names[:1], names[1:]), (names,)]
    for place in places:
        for columns in splits:
            widths = [max(sizes[name][0] for name in column) for column in columns]
            heights = [sum(sizes[name][1] + spacing for name in column) - spacing for column in columns]
            width = math.ceil(sum(widths) + gap * (len(columns) - 1) + padding[0])
            height = math.ceil(max(heights) + padding[1])
            if width <= place[2] and height <= place[3]:
                return Layout(columns, place, width, height, True)
    place = next((place for place in places if width + scrollbar <= place[2]), places[-1])
    return Layout((names,), place, min(width + scrollbar, place[2]), min(height, place[3]), False)


def _label_width(bindings: Sequence[Binding]) -> float:
    return max(imgui.calc_text_size(binding.label).x for binding in bindings) + imgui.get_font_size()


def _size(bindings: Sequence[Binding]) -> tuple[float, float]:
    """Width and height of a group, its lines not wrapped."""
    rows = len(bindings) + 1
    meanings = max(imgui.calc_text_size(binding.meaning).x for binding in bindings)
    height = rows * imgui.get_text_line_height() + (rows - 1) * imgui.get_style().item_spacing.y
    return _label_width(bindings) + meanings, height


def _draw_group(bindings: Sequence[Binding], wraps: bool) -> None:
    imgui.text_colored(style.ACCENT, bindings[0].group)
    column = _label_width(bindings)
    if wraps:
        imgui.push_text_wrap_pos(0.0)
    for binding in bindings:
        imgui.text_unformatted(binding.label)
        imgui.same_line(column)  # from where the group begins
        imgui.text_unformatted(binding.meaning)
    if wraps:
        imgui.pop_text_wrap_pos()
