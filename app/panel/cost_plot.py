"""Error over milliseconds: a mark for each candidate, those worth having joined, the reference's noise as a line."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from imgui_bundle import imgui, implot

from ..measure.candidates import Candidate
from ..measure.live import HEAT_RANGE
from ..measure.quote import METRICS, Priced, best
from ..measure.survey import Measured
from . import style
from .colormap import sequential
from .plots import COLORS, FLAGS, HEIGHT_EM, MARKERS, NOISE, QUIET, Axis, figure_label, figure_text, legend, prepare

REACH_EM = 0.8  # from a mark within which the pointer means it
CLICK_SLOP = 4.0  # window units that the pointer may wander between press and release; further, and it dragged the plot
THUMBNAIL_EM, SCALE_EM = 16.0, 4.5  # widths of the difference picture and of its scale
WHITE = imgui.ImVec4(1.0, 1.0, 1.0, 1.0)
MAP_STEPS = 64  # colours of the map: finer than the eye tells apart


@dataclass(frozen=True)
class Mark:
    """One candidate, or the view on screen, and what was measured of it."""

    candidate: Candidate
    measured: Measured
    priced: Priced


class CostPlot:
    """Remembers what it shows, and where its marks were drawn."""

    def __init__(self) -> None:
        self._x, self._y = Axis(implot.ImAxis_.x1), Axis(implot.ImAxis_.y1)
        self._fitted: object = None
        self._pressed: tuple[str, float, float] = ("", 0.0, 0.0)
        self._map = -1
        self.places: dict[str, tuple[float, float]] = {}  # of the marks by label, window units

    def draw(
        self, marks: Sequence[Mark], own: Mark | None, noise: float, metric: str, size: tuple[int, int]
    ) -> Mark | None:
        """Draw the plot; returns the mark that was clicked."""
        shown = [*marks, *([own] if own else [])]
        figures = [*(m.priced.figure for m in shown), noise]
        key = (metric, tuple(m.priced for m in shown), noise)
        fit, self._fitted = key != self._fitted, key
        prepare()
        clicked = None
        self.places = {}
        views = dict.fromkeys(m.candidate.view for m in shown)
        legend(
            [
                *((v, COLORS[v]) for v in views),
                ("on screen", WHITE),
                ("worth having", QUIET),
                ("noise floor", NOISE),
            ]
        )
        if implot.begin_plot("##cost", imgui.ImVec2(-1.0, HEIGHT_EM * imgui.get_font_size()), FLAGS):
            self._x.setup(f"ms per frame at {size[0]} x {size[1]} px", [m.priced.ms for m in shown], True, fit)
            self._y.setup(figure_label(metric), figures, not METRICS[metric].rises, fit)
            _lines([m.priced for m in marks], noise, metric)
            _marks(marks)
            if own:
                _own(own)
            self.places = {m.priced.label: _pixel(m) for m in shown}
            over = self._under_pointer(shown) if implot.is_plot_hovered() else None
            clicked = self._click(over)
            self._x.note()
            self._y.note()
            implot.end_plot()
            if over:
                self._tooltip(over, metric)
        return clicked

    def _under_pointer(self, shown: Sequence[Mark]) -> Mark | None:
        """The nearest mark within reach; of equally near ones the first, since the view on screen hides a candidate."""
        at = imgui.get_mouse_pos()
        distances = [math.dist(self.places[m.priced.label], (at.x, at.y)) for m in shown]
        nearest = min(range(len(shown)), key=distances.__getitem__, default=None)
        if nearest is None or distances[nearest] > REACH_EM * imgui.get_font_size():
            return None
        return shown[nearest]

    def _click(self, over: Mark | None) -> Mark | None:
        at = imgui.get_mouse_pos()
        if imgui.is_mouse_clicked(0):
            self._pressed = (over.priced.label if over else "", at.x, at.y)
        label, x, y = self._pressed
        if not imgui.is_mouse_released(0) or math.dist((x, y), (at.x, at.y)) > CLICK_SLOP:
            return None
        self._pressed = ("", 0.0, 0.0)
        return over if over and over.priced.label == label else None

    def _tooltip(self, mark: Mark, metric: str) -> None:
        imgui.begin_tooltip()
        imgui.text_colored(COLORS[mark.candidate.view], mark.candidate.label)
        imgui.text_unformatted(f"{mark.priced.ms:.3g} ms, {_figure(mark.priced, metric)}")
        imgui.text_colored(style.MUTED, "Click to see it. Where it is wrong:")
        self._thumbnail(mark.measured.difference)
        imgui.end_tooltip()

    def _thumbnail(self, difference: np.ndarray) -> None:
        """The difference picture in the heat map's colours, with their scale."""
        if self._map < 0:
            steps = sequential(np.linspace(0.0, 1.0, MAP_STEPS))
            packed = [
                imgui.color_convert_float4_to_u32(imgui.ImVec4(float(c[0]), float(c[1]), float(c[2]), 1.0))
                for c in steps
            ]
            found = implot.get_colormap_index("error")
            self._map = found if found >= 0 else implot.add_colormap("error", np.array(packed, np.uint32), False)
        width = THUMBNAIL_EM * imgui.get_font_size()
        height = width * difference.shape[0] / difference.shape[1]
        implot.push_colormap(self._map)
        implot.push_style_var(implot.StyleVar_.plot_padding, imgui.ImVec2(0.0, 0.0))
        if implot.begin_plot("##where", imgui.ImVec2(width, height), implot.Flags_.canvas_only):
            bare = implot.AxisFlags_.no_decorations
            implot.setup_axis(implot.ImAxis_.x1, None, bare)
            implot.setup_axis(implot.ImAxis_.y1, None, bare)
            implot.setup_axis_limits(implot.ImAxis_.x1, 0.0, 1.0, implot.Cond_.always)
            implot.setup_axis_limits(implot.ImAxis_.y1, 0.0, 1.0, implot.Cond_.always)
            implot.plot_heatmap("##difference", np.ascontiguousarray(difference), *HEAT_RANGE, "")
            implot.end_plot()
        imgui.same_line()
        implot.colormap_scale("##scale", *HEAT_RANGE, imgui.ImVec2(SCALE_EM * imgui.get_font_size(), height), "%.2f")
        implot.pop_style_var()
        implot.pop_colormap()


def _lines(priced: Sequence[Priced], noise: float, metric: str) -> None:
    kept = best(priced, metric)
    if len(kept) > 1:
        xs, ys = (np.array(values) for values in zip(*((p.ms, p.figure) for p in kept), strict=True))
        implot.plot_line("worth having", xs, ys, implot.Spec(line_color=QUIET, line_weight=1.5))
    if math.isfinite(noise):
        flat = implot.InfLinesFlags_.horizontal
        implot.plot_inf_lines("noise floor", np.array([noise]), implot.Spec(line_color=NOISE, flags=flat))


def _marks(marks: Sequence[Mark]) -> None:
    by_view: Mapping[str, list[Priced]] = {m.candidate.view: [] for m in marks}
    for mark in marks:
        by_view[mark.candidate.view].append(mark.priced)
    for view, priced in by_view.items():
        color = COLORS[view]
        spec = implot.Spec(
            marker=MARKERS[view], marker_size=4.5, marker_fill_color=color, marker_line_color=color, line_color=color
        )
        implot.plot_scatter(view, np.array([p.ms for p in priced]), np.array([p.figure for p in priced]), spec)


def _own(own: Mark) -> None:
    clear = imgui.ImVec4(0.0, 0.0, 0.0, 0.0)
    spec = implot.Spec(
        marker=implot.Marker_.circle, marker_size=8.0, marker_fill_color=clear, marker_line_color=WHITE, line_weight=2.0
    )
    implot.plot_scatter("on screen", np.array([own.priced.ms]), np.array([own.priced.figure]), spec)


def _pixel(mark: Mark) -> tuple[float, float]:
    at = implot.plot_to_pixels(mark.priced.ms, mark.priced.figure)
    return at.x, at.y


def _figure(priced: Priced, metric: str) -> str:
    return figure_text(priced.figure, metric, priced.at_floor)
