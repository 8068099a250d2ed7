"""What lies over the picture: help, messages that fade, loading progress, and the names of the split screen's sides."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from .colormap import sequential
from .help import draw_help
from .model import HeatShown, Look, Shown
from .views import LEGEND_STEPS, draw_bar, draw_ticks

Rect = tuple[float, float, float, float]  # x, y from the top left, width, height; window units

_PASSIVE = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.always_auto_resize
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_inputs
    | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.no_nav
)
SCALE_EM = 19.0  # width of the heat map's scale
MARGIN = 10.0  # px between a label and the picture's edge


def draw_overlays(look: Look, shown: Shown, picture: Rect) -> None:
    """Draw everything that applies now."""
    if look.compare and look.panel:
        _side_names(look, picture)
    if shown.heat:
        below = 2.2 * imgui.get_font_size() if look.compare and look.panel else 0.0  # the names of the sides
        _heat_scale(shown.heat, (picture[0], picture[1] + below, *picture[2:]))
    if look.help:
        draw_help(picture)
    if shown.loading:
        _progress(*shown.loading, picture)
    elif shown.message:
        _box(
            "message",
            shown.message,
            (picture[0] + MARGIN, picture[1] + picture[3] - MARGIN),
            (0.0, 1.0),
            picture[2] - 2 * MARGIN,
        )


def _box(name: str, text: str, at: tuple[float, float], pivot: tuple[float, float], width: float = 0.0) -> None:
    imgui.set_next_window_pos(imgui.ImVec2(*at), imgui.Cond_.always, imgui.ImVec2(*pivot))
    imgui.set_next_window_bg_alpha(0.75)
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(8.0, 4.0))
    imgui.begin(f"##{name}", None, _PASSIVE)
    if width > 0.0:
        imgui.push_text_wrap_pos(max(width - 16.0, 60.0))
    imgui.text_unformatted(text)
    if width > 0.0:
        imgui.pop_text_wrap_pos()
    imgui.end()
    imgui.pop_style_var()


def _side_names(look: Look, picture: Rect) -> None:
    x, y, width, _ = picture
    bar = x + look.bar * width
    _box("left name", look.view, (bar - MARGIN, y + MARGIN), (1.0, 0.0))
    _box("right name", look.other, (bar + MARGIN, y + MARGIN), (0.0, 0.0))


def _heat_scale(heat: HeatShown, picture: Rect) -> None:
    """What the map's colours mean, at the picture's top left; until there is a map, how far its reference is."""
    x, y, width, _ = picture
    if not heat.ready:
        drawing = f"drawing the true picture: {100 * heat.part:.0f} %"
        text = drawing if heat.part else "where it is wrong: shown of a view that stands still"
        _box("heat", text, (x + MARGIN, y + MARGIN), (0.0, 0.0))
        return
    low, high = heat.ends
    imgui.set_next_window_pos(imgui.ImVec2(x + MARGIN, y + MARGIN), imgui.Cond_.always)
    imgui.set_next_window_size(imgui.ImVec2(min(SCALE_EM * imgui.get_font_size(), max(width - 2 * MARGIN, 1.0)), 0.0))
    imgui.set_next_window_bg_alpha(0.75)
    imgui.begin("##heat scale", None, _PASSIVE & ~imgui.WindowFlags_.always_auto_resize)
    imgui.text_unformatted("error, as displayed (1: black for white)")
    draw_bar(sequential(np.linspace(0.0, 1.0, LEGEND_STEPS)))
    draw_ticks(f"{low:.3g}", f"{(low + high) / 2:.3g}", f"{high:.3g} and more")
    imgui.end()


def _progress(stage: str, fraction: float, picture: Rect) -> None:
    x, y, width, height = picture
    imgui.set_next_window_pos(imgui.ImVec2(x + width / 2, y + height / 2), imgui.Cond_.always, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_bg_alpha(0.9)
    imgui.begin("##loading", None, _PASSIVE)
    imgui.text_unformatted(stage)
    imgui.progress_bar(fraction, imgui.ImVec2(min(22 * imgui.get_font_size(), 0.8 * width), 0.0))
    imgui.end()
