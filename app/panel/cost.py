"""The panel's section on cost: what more accuracy costs for the picture on screen, and what the time spent buys."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from imgui_bundle import imgui, implot

from ..measure.candidates import Candidate
from ..measure.metrics import WHOLE, Errors, has_flip
from ..measure.quote import METRICS, Metric, Priced, clearly_better, independent, quoted, worth
from ..measure.regions import REGIONS
from ..measure.subject import applied
from ..measure.survey import FRAMES, Findings, Measured
from .cost_plot import CostPlot, Mark
from .costs import muted
from .knobs import LABEL_EM
from .model import HeatShown, Look, Shown, SurveyShown, SurveyWish
from .plots import COLORS, FLAGS, HEIGHT_EM, NOISE, QUIET, Axis, figure_text, legend

WIDTHS = (160, 240, 320, 480, 640)  # px of a measured picture
AREAS = (WHOLE, "in_focus", "far_blur", "near_silhouettes", "near_blur")


class CostSection:
    """Remembers how errors are spoken of."""

    def __init__(self) -> None:
        self._metric, self._region = "psnr", WHOLE
        self._plot, self._curve = CostPlot(), _Curve()
        self._was_open = False

    @property
    def places(self) -> Mapping[str, tuple[float, float]]:
        """Where the plot's marks are, by label, in window units."""
        return self._plot.places

    def draw(self, look: Look, shown: Shown) -> Look:
        """Draw the section, open or not; returns what the user now wants to see."""
        if look.survey.open and not self._was_open:
            imgui.set_scroll_here_y(0.0)  # opened by its key: it may be out of sight
        imgui.set_next_item_open(look.survey.open)
        opened = imgui.collapsing_header("Cost of accuracy")
        self._was_open = opened
        look = replace(look, survey=replace(look.survey, open=opened))
        self._plot.places = {}
        if not opened:
            return look
        look = self._heat(look, shown.heat)
        look = replace(look, survey=self._choices(look.survey))
        return self._survey(look, shown.survey, shown.timing_source) if shown.survey else look

    def _choices(self, wish: SurveyWish) -> SurveyWish:
        self._metric = _choose("figure", METRICS, self._metric, {n: m.title for n, m in METRICS.items()})
        self._region = _choose("region", AREAS, self._region, {n: n.replace("_", " ") for n in AREAS}, REGIONS)
        names = {str(w): f"{w} px wide (16:9)" for w in WIDTHS}
        width = int(_choose("size", list(names), str(wish.width), names))
        _, dear = imgui.checkbox("with 8 to 64 traced samples a frame", wish.dear)
        imgui.set_item_tooltip("These take longest, by far")
        return replace(wish, width=width, dear=dear, flip=self._metric == "flip")

    def _survey(self, look: Look, survey: SurveyShown, clock: str) -> Look:
        findings = survey.findings
        _progress(survey)
        if findings.floor is None:
            return look
        floor = findings.floor[self._region]
        noise = float(getattr(floor, self._metric))
        if self._metric == "flip" and math.isnan(noise):
            muted("FLIP comes next" if has_flip() else "FLIP is not installed: pip install 'hybrid-dof[metrics]'")
            return look
        if math.isnan(floor.rmse):
            muted("no pixel of this picture is in that region")
            return look
        marks = [m for c, found in findings.points if (m := self._mark(c, found, floor))]
        own = self._mark(*findings.own, floor) if findings.own else None
        clicked = self._plot.draw(marks, own, noise, self._metric, findings.size)
        if own:
            _advice(own.priced, [m.priced for m in marks], self._metric)
        muted(
            f"Each after {FRAMES} frames that stand still; {clock}. Times and errors are of this small picture, whose "
            "blur is as much smaller. Ctrl+wheel zooms, dragging moves, a double click shows all."
        )
        if findings.own and findings.curve:
            self._curve.draw(findings, self._region, self._metric if self._metric != "flip" else "psnr")
        if clicked:
            settings = applied(clicked.candidate, look.settings)
            look = replace(look, view=clicked.candidate.view, settings=settings)
        return look

    def _mark(self, candidate: Candidate, found: Measured | None, floor: Errors) -> Mark | None:
        if found is None:
            return None
        figure, at_floor = quoted(found.errors[self._region], floor, self._metric)
        if math.isnan(figure):  # FLIP follows later
            return None
        return Mark(candidate, found, Priced(candidate.label, found.ms, figure, at_floor))

    def _heat(self, look: Look, heat: HeatShown | None) -> Look:
        _, wanted = imgui.checkbox("show where it is wrong", look.heat)
        imgui.set_item_tooltip("A map of the error over the picture (key H); its true picture is drawn first")
        if heat and heat.errors and heat.floor:
            metric = self._metric if self._metric != "flip" else "psnr"
            figure = quoted(heat.errors[self._region], heat.floor[self._region], metric)
            imgui.text_unformatted(f"on screen now: {figure_text(figure[0], metric, figure[1])}")
        return replace(look, heat=wanted)


class _Curve:
    """How the error of the view on screen falls with the frames that it stands still."""

    def __init__(self) -> None:
        self._x, self._y = Axis(implot.ImAxis_.x1), Axis(implot.ImAxis_.y1)
        self._fitted: object = None

    def draw(self, findings: Findings, region: str, metric: str) -> None:
        assert findings.own
        assert findings.floor
        view, floor = findings.own[0].view, findings.floor[region]
        points = [(n, quoted(errors[region], floor, metric)[0]) for n, errors in findings.curve]
        key = (view, metric, region, len(points), findings.size)
        fit, self._fitted = key != self._fitted, key
        noise = float(getattr(floor, metric))
        imgui.separator_text(f"{view}, frame by frame")
        slope = _slope(METRICS[metric])
        legend([(view, COLORS[view]), (slope, QUIET), ("noise floor", NOISE)])
        if not implot.begin_plot("##curve", imgui.ImVec2(-1.0, 0.8 * HEIGHT_EM * imgui.get_font_size()), FLAGS):
            return
        log = not METRICS[metric].rises
        self._x.setup(f"frames at {findings.size[0]} x {findings.size[1]} px", [1, *(n for n, _ in points)], True, fit)
        self._y.setup(METRICS[metric].title, [noise, *(y for _, y in points)], log, fit)
        flat = implot.InfLinesFlags_.horizontal
        implot.plot_inf_lines("noise floor", np.array([noise]), implot.Spec(line_color=NOISE, flags=flat))
        xs = np.array([n for n, _ in points], float)
        expected = np.array([independent(points[0][1], n, metric) for n, _ in points])
        implot.plot_line(slope, xs, expected, implot.Spec(line_color=QUIET, line_weight=1.0))
        spec = implot.Spec(line_color=COLORS[view], line_weight=2.0)
        implot.plot_line(view, xs, np.array([y for _, y in points]), spec)
        self._x.note()
        self._y.note()
        implot.end_plot()


def _slope(metric: Metric) -> str:
    return {1.0: "as 1 / sqrt(frames)", 2.0: "as 1 / frames"}.get(metric.power, "as 1 / sqrt(frames), in dB")


def _progress(survey: SurveyShown) -> None:
    findings = survey.findings
    if survey.plays:
        muted("The scene moves: press P, and it is measured as it stands then.")
    elif survey.moving:
        muted("Measured again when the camera stands still.")
    elif findings.doing:
        imgui.progress_bar(findings.part, imgui.ImVec2(-1.0, 0.0), f"measuring {findings.doing}")
    elif findings.points:
        found = f"{findings.measured} ways measured at {findings.size[0]} x {findings.size[1]} px"
        imgui.text_unformatted(found)


def _advice(now: Priced, points: Sequence[Priced], metric: str) -> None:
    """What the time buys, and what more would cost, in words."""
    better, cheaper = worth(now, points, metric)
    imgui.text_unformatted(f"On screen: {now.ms:.3g} ms, {figure_text(now.figure, metric, now.at_floor)}")
    imgui.push_text_wrap_pos(0.0)
    if cheaper and cheaper is not better:
        gains = clearly_better(cheaper.figure, now.figure, metric)
        loses = clearly_better(now.figure, cheaper.figure, metric)
        _offer(now, cheaper, ", and better" if gains else "" if loses else ", as good", metric)
    if better:
        _offer(now, better, "" if better.ms > now.ms else ", and better", metric)
    elif points:
        imgui.text_unformatted("Nothing measured here is better.")
    imgui.pop_text_wrap_pos()


def _offer(now: Priced, other: Priced, remark: str, metric: str) -> None:
    price = f"{abs(other.ms - now.ms):.3g} ms {'more' if other.ms > now.ms else 'less'}{remark}"
    imgui.text_unformatted(f"For {price}: {other.label}, {figure_text(other.figure, metric, other.at_floor)}")


def _choose(
    label: str,
    names: Sequence[str] | Mapping[str, object],
    chosen: str,
    titles: Mapping[str, str],
    tips: Mapping[str, str] | None = None,
) -> str:
    imgui.set_next_item_width(imgui.get_content_region_avail().x - LABEL_EM * imgui.get_font_size())
    if imgui.begin_combo(label, titles.get(chosen, chosen)):
        for name in names:
            if imgui.selectable(titles[name], name == chosen)[0]:
                chosen = name
            if tips and name in tips:
                imgui.set_item_tooltip(tips[name])
        imgui.end_combo()
    return chosen
