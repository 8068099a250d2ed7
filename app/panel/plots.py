"""What the plots share: one colour a view, readable ticks on logarithmic axes, and limits that follow new data."""

from __future__ import annotations

import math
from collections.abc import Sequence

from imgui_bundle import imgui, implot

from ..measure.quote import METRICS

# Blue against orange, and lightness, survive the common colour-vision deficiencies.
COLORS = {
    "sharp": imgui.ImVec4(0.70, 0.70, 0.70, 1.0),
    "post": imgui.ImVec4(0.95, 0.62, 0.25, 1.0),
    "hybrid": imgui.ImVec4(0.38, 0.66, 0.98, 1.0),
    "traced": imgui.ImVec4(0.55, 0.85, 0.50, 1.0),
    "reference": imgui.ImVec4(0.85, 0.60, 0.90, 1.0),
}
MARKERS = {
    "sharp": implot.Marker_.diamond,
    "post": implot.Marker_.square,
    "hybrid": implot.Marker_.circle,
    "traced": implot.Marker_.up,
    "reference": implot.Marker_.down,
}
QUIET = imgui.ImVec4(0.62, 0.64, 0.67, 0.8)
NOISE = imgui.ImVec4(0.85, 0.35, 0.35, 0.9)
HEIGHT_EM = 15.0
MARGIN = 0.08  # of the axis, on either side of the data
FLAGS = implot.Flags_.no_title | implot.Flags_.no_menus | implot.Flags_.no_mouse_text | implot.Flags_.no_legend


def prepare() -> None:
    """The wheel scrolls the panel; with Ctrl it zooms the plot."""
    implot.get_input_map().zoom_mod = int(imgui.Key.mod_ctrl)


def legend(entries: Sequence[tuple[str, imgui.ImVec4]]) -> None:
    """Names in their colours, above a plot that has no room for them inside; as many rows as it takes."""
    space = imgui.get_style().item_spacing.x * 2.0
    for index, (name, color) in enumerate(entries):
        if index:
            imgui.same_line(0.0, space)
            if imgui.get_content_region_avail().x < imgui.calc_text_size(name).x:
                imgui.new_line()
        imgui.text_colored(color, name)


class Axis:
    """One axis of one plot, which remembers what it showed last."""

    def __init__(self, axis: int) -> None:
        self._axis, self._shown = axis, (0.0, 0.0)

    def setup(self, label: str, values: Sequence[float], log: bool, fit: bool) -> None:
        """Name the axis, and with `fit` show all values on it."""
        implot.setup_axis(self._axis, label)
        finite = [v for v in values if math.isfinite(v) and (v > 0.0 or not log)]
        if log:
            implot.setup_axis_scale(self._axis, implot.Scale_.log10)
        if fit or self._shown[0] == self._shown[1]:
            self._shown = limits(finite, log)
            implot.setup_axis_limits(self._axis, *self._shown, implot.Cond_.always)
        if log:
            ticks = log_ticks(*self._shown)
            implot.setup_axis_ticks(self._axis, ticks, [f"{t:g}" for t in ticks])

    def note(self) -> None:
        """Remember what the person's dragging and zooming left to see; call it before the plot ends."""
        seen = implot.get_plot_limits()
        ends = seen.x if self._axis == implot.ImAxis_.x1 else seen.y
        self._shown = ends.min, ends.max


def limits(values: Sequence[float], log: bool) -> tuple[float, float]:
    """Ends of an axis that shows all the values with a margin."""
    if not values:
        return (1.0, 10.0) if log else (0.0, 1.0)
    low, high = min(values), max(values)
    if log:
        room = max(math.log(high / low), math.log(2.0)) * MARGIN
        return low * math.exp(-room), high * math.exp(room)
    room = max(high - low, 1e-3 * max(abs(high), abs(low)), 1e-9) * MARGIN
    return low - room, high + room


def log_ticks(low: float, high: float) -> list[float]:
    """Round numbers between the ends, no more than a narrow axis has room for."""
    if not 0.0 < low < high:
        return []
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    few = list(decades)[:: max(1, len(decades) // 5)]
    for steps in ((1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9), (1, 2, 3, 5, 7), (1, 2, 5), (1, 3), (1,)):
        ticks = [float(f"{s * 10.0**d:.6g}") for d in few for s in steps]
        found = [t for t in ticks if low <= t <= high]
        if len(found) <= 6:
            break
    return found


def figure_label(metric: str) -> str:
    """A metric as an axis shows it, with the way that is better."""
    of = METRICS[metric]
    return f"{of.title} [{of.unit}], {'higher' if of.rises else 'lower'} is better"


def figure_text(figure: float, metric: str, at_floor: bool) -> str:
    """A figure as a sentence holds it."""
    bound = "" if not at_floor else "at least " if METRICS[metric].rises else "at most "
    unit = " dB" if METRICS[metric].rises else ""
    return f"{METRICS[metric].title} {bound}{figure:.3g}{unit}"
