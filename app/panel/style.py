"""Fonts and colours: a readable typeface at the screen's density, and quiet greys, since the picture is the point."""

from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

FONT_PX = 15.0  # at 96 dots per inch; the bundled default of 13 is a bitmap that blurs when scaled
FONT = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"

TOOLTIP_EM = 22  # width of a tooltip's lines, in font heights

ACCENT = imgui.ImVec4(0.35, 0.62, 0.90, 1.0)
MUTED = imgui.ImVec4(0.62, 0.64, 0.67, 1.0)
ERROR = imgui.ImVec4(1.0, 0.56, 0.46, 1.0)
_GREYS = {
    "window_bg": (0.11, 0.115, 0.125, 1.0),
    "popup_bg": (0.15, 0.155, 0.165, 0.98),
    "frame_bg": (0.19, 0.20, 0.22, 1.0),
    "frame_bg_hovered": (0.25, 0.27, 0.30, 1.0),
    "frame_bg_active": (0.29, 0.32, 0.37, 1.0),
    "title_bg": (0.11, 0.115, 0.125, 1.0),
    "title_bg_active": (0.14, 0.15, 0.165, 1.0),
    "header": (0.18, 0.20, 0.23, 1.0),
    "header_hovered": (0.24, 0.28, 0.33, 1.0),
    "header_active": (0.27, 0.33, 0.40, 1.0),
    "button": (0.22, 0.24, 0.27, 1.0),
    "button_hovered": (0.28, 0.33, 0.39, 1.0),
    "button_active": (0.30, 0.42, 0.55, 1.0),
    "slider_grab": (0.35, 0.62, 0.90, 0.6),
    "slider_grab_active": (0.50, 0.75, 1.0, 1.0),
    "check_mark": (0.45, 0.72, 1.0, 1.0),
    "separator": (0.25, 0.27, 0.30, 1.0),
    "text": (0.90, 0.91, 0.92, 1.0),
    "text_disabled": (0.62, 0.64, 0.67, 1.0),
    "plot_histogram": (0.35, 0.62, 0.90, 1.0),
}


def apply(density: float) -> None:
    """Set fonts and colours of the current ImGui context; `density` is the screen's scale (1 at 96 dots per inch)."""
    style = imgui.get_style()
    for name, color in _GREYS.items():
        style.set_color_(int(getattr(imgui.Col_, name)), imgui.ImVec4(*color))
    style.window_rounding = style.window_border_size = 0.0
    style.frame_rounding = style.grab_rounding = 3.0
    style.item_spacing = imgui.ImVec2(6.0, 5.0)
    style.scale_all_sizes(density)
    style.font_scale_dpi = density
    io = imgui.get_io()
    if FONT.is_file():
        io.fonts.add_font_from_file_ttf(str(FONT), FONT_PX)
    else:
        io.fonts.add_font_default_vector()


def wrapped(text: str, color: imgui.ImVec4) -> None:
    """Text in a colour, as many lines as it takes."""
    imgui.push_style_color(imgui.Col_.text, color)
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.pop_style_color()
