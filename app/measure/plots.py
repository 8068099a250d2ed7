"""A benchmark's results as pictures, three for each scene: error over time, where the time goes, convergence."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import UserError
from ..files import write_atomically
from .bench import checkpoints, error, metric_of, slug
from .bench_report import NAMES, NEAR, median_ms, number
from .candidates import front
from .metrics import WHOLE
from .plot_labels import Label, place

Values = dict[str, Any]

DOTS_PER_INCH = 130
COLOURS = {"sharp": "#555555", "post": "#0072b2", "hybrid": "#d55e00", "traced": "#009e73"}  # told apart by all eyes
MARKERS = {"sharp": "s", "post": "o", "hybrid": "D", "traced": "^"}
LEGEND = {
    "sharp": "sharp: no depth of field",
    "post": "post-process (number: rings)",
    "hybrid": "hybrid (number: rays per masked pixel)",
    "traced": "ray-traced (number: samples per frame)",
}
PLACES = {WHOLE: "whole picture", NEAR: "near silhouettes"}
JOINED = 0.06  # relative distance below which two labels would cover each other
SMALL_SHARE = 0.02  # of the longest bar: passes below it everywhere are added up


def write_plots(results: Values, folder: Path) -> list[Path]:
    """PNG files. Raises UserError without the `plots` extra."""
    try:
        import matplotlib.figure as _  # noqa: F401
    except ImportError:
        raise UserError("the plots need matplotlib: pip install 'hybrid-dof[plots]', then run the same again") from None
    files = []
    for scene in results["scenes"]:
        for kind, draw in (("error-time", error_time), ("passes", passes), ("convergence", convergence)):
            if (figure := draw(results, scene)) is not None:
                files.append(folder / f"{slug(scene['name'])}-{kind}.png")
                _save(figure, files[-1])
    return files


def error_time(results: Values, scene: Values) -> Any:
    """Error over milliseconds of a frame: a column after one frame and one after many, a row for each place."""
    runs, metric, frames = scene["runs"], metric_of(scene["runs"]), results["frames"]
    rows = [r for r in PLACES if any(_positive(error(run, 1, metric, r)) for run in runs)]
    columns = [1, frames] if frames > 1 else [1]
    if not rows:
        return None
    figure = _figure(results, (5.4 * len(columns), 3.9 * len(rows) + 0.9))
    panels = figure.subplots(len(rows), len(columns), sharex=True, sharey="row", squeeze=False)
    drawn = []
    for across, region in zip(panels, rows, strict=True):
        floor = scene["floor"][region][metric]
        for axes, after in zip(across, columns, strict=True):
            labels, lines = _points(axes, runs, metric, after, region)
            if _positive(floor):
                axes.axhline(floor, color="0.5", linestyle=":", linewidth=1, zorder=0)
            told = "after the first frame" if after == 1 else f"after {after} frames"
            axes.set_title(f"{PLACES[region]}, {told}", fontsize=10)
            axes.set(xscale="log", yscale="log")
            axes.margins(x=0.12, y=0.14)
            axes.grid(color="0.92", linewidth=0.6)
            drawn.append((axes, labels, lines))
        across[0].set_ylabel(f"mean {NAMES[metric]} against the reference" if metric == "flip" else "RMSE, radiance")
    for axes in panels[-1]:
        axes.set_xlabel("ms of one frame (median, with its 95 % interval)")
    _plain_ticks(panels)
    _legend(figure, runs, f"{scene['name']}: error over time, lower left is better", front_too=True)
    figure.canvas.draw()  # settles the layout and the limits
    figure.set_layout_engine("none")
    for axes, labels, lines in drawn:
        place(figure, axes, labels, lines)
    return figure


def _points(axes: Any, runs: list[Values], metric: str, after: int, region: str) -> tuple[list[Any], list[Any]]:
    """Draws them and their front; (labels, lines) for `place`."""
    known = [(median_ms(run), error(run, after, metric, region), run) for run in runs]
    known = [(ms, wrong, run) for ms, wrong, run in known if _positive(ms) and _positive(wrong)]
    best = [known[i][:2] for i in front([(ms, wrong) for ms, wrong, _ in known])]
    axes.plot(*zip(*best, strict=True), color="#f0c000", linewidth=6, alpha=0.45, zorder=1, solid_capstyle="round")
    lines = [best]
    for view, colour in COLOURS.items():
        line = [(ms, wrong) for ms, wrong, run in known if run["view"] == view]
        if line:
            axes.plot(
                *zip(*line, strict=True), color=colour, marker=MARKERS[view], markersize=4.5, linewidth=1, zorder=3
            )
            lines.append(line)
    for _, wrong, run in known:
        times = run["times"]["frame"]
        if times["low"] is not None:
            interval = [(times["low"], wrong), (times["high"], wrong)]
            axes.plot(*zip(*interval, strict=True), color=COLOURS[run["view"]], linewidth=0.8, zorder=2)
            lines.append(interval)
    return [(ms, wrong, _short(run), COLOURS[run["view"]]) for ms, wrong, run in known], lines


def passes(results: Values, scene: Values) -> Any:
    """A bar for each candidate, made of its passes."""
    runs = [run for run in scene["runs"] if run["times"]["passes"]]
    others = [sum(_medians(run).values()) for run in runs if run["view"] != "traced"]
    longest = max(others, default=math.inf)
    shown = [run for run in runs if run["view"] != "traced" or sum(_medians(run).values()) <= longest]
    shown = shown or runs[:1]
    if not shown:
        return None
    figure = _figure(results, (10.8, 1.7 + 0.36 * len(shown)))
    axes = figure.subplots()
    names = list(dict.fromkeys(name for run in shown for name in run["times"]["passes"]))
    total = max(sum(_medians(run).values()) for run in shown)
    large = [name for name in names if max(_medians(run).get(name, 0.0) for run in shown) >= SMALL_SHARE * total]
    small = [name for name in names if name not in large]
    from matplotlib import colormaps

    palette = [colormaps[name](i) for name in ("tab20", "tab20b") for i in range(20)]
    places, begin = range(len(shown)), [0.0] * len(shown)
    for i, name in enumerate([*large, *(["other passes"] if small else [])]):
        parts = small if name == "other passes" else [name]
        widths = [sum(_medians(run).get(part, 0.0) for part in parts) for run in shown]
        colour = "0.75" if name == "other passes" else palette[i % len(palette)]
        axes.barh(places, widths, left=begin, color=colour, label=name, edgecolor="white", linewidth=0.4)
        begin = [b + w for b, w in zip(begin, widths, strict=True)]
    axes.plot([median_ms(run) for run in shown], places, "k|", markersize=13, label="whole frame")
    axes.set_yticks(places, [run["label"] for run in shown])
    axes.invert_yaxis()
    axes.set_xlabel(
        "ms of one frame (medians; a pass is finished before the next begins, a whole frame is not divided)"
    )
    axes.grid(axis="x", color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8, frameon=False)
    left_out = len(scene["runs"]) - len(shown)
    note = f" (left out: {left_out} of more traced samples, longer than these)" if left_out else ""
    axes.set_title(f"{scene['name']}: where the time of a frame goes{note}", fontsize=11)
    return figure


def convergence(results: Values, scene: Values) -> Any:
    """Error over accumulated frames, with the slope of independent samples."""
    runs, frames = scene["runs"], results["frames"]
    columns = [r for r in PLACES if any(_positive(error(run, 1, "rmse", r)) for run in runs)]
    if not columns or frames < 2:
        return None
    figure = _figure(results, (5.4 * len(columns), 6.2))
    panels = figure.subplots(1, len(columns), squeeze=False)[0]
    drawn = []
    for axes, region in zip(panels, columns, strict=True):
        ends: list[Label] = []
        lines: list[list[tuple[float, float]]] = []
        for run, shade in _shaded(runs):
            line = [(float(n), error(run, int(n), "rmse", region)) for n in sorted(run["errors"], key=int)]
            line = [(n, wrong) for n, wrong in line if _positive(wrong)]
            if line:
                colour = COLOURS[run["view"]]
                axes.plot(
                    *zip(*line, strict=True), color=colour, alpha=shade, marker=MARKERS[run["view"]], markersize=3
                )
                ends.append((*line[-1], _short(run), colour))
                lines.append(line)
        top = max(wrong for line in lines for _, wrong in line)
        slope = [(float(n), 0.8 * top / math.sqrt(n)) for n in (1, frames)]
        axes.plot(*zip(*slope, strict=True), color="black", linestyle="--", linewidth=1)
        if _positive(floor := scene["floor"][region]["rmse"]):
            axes.axhline(floor, color="0.5", linestyle=":", linewidth=1, zorder=0)
        axes.set(xscale="log", yscale="log", xlabel="accumulated frames")
        axes.set_title(PLACES[region], fontsize=10)
        axes.set_xlim(0.9, frames * 1.9)
        axes.margins(y=0.08)
        axes.grid(color="0.92", linewidth=0.6)
        drawn.append((axes, _joined(ends), [*lines, slope]))
    panels[0].set_ylabel("RMSE, radiance")
    _plain_ticks([panels])
    for axes in panels:
        axes.set_xticks(checkpoints(frames))
    _legend(figure, runs, f"{scene['name']}: convergence while the picture stands still", slope_too=True)
    figure.canvas.draw()
    figure.set_layout_engine("none")
    for axes, ends, lines in drawn:
        place(figure, axes, ends, lines)
    return figure


def _joined(ends: list[Label]) -> list[Label]:
    """One label for the ends of a view's lines that lie on each other."""
    joined: list[Label] = []
    for x, y, text, colour in ends:
        for i, (other_x, other_y, others, other_colour) in enumerate(joined):
            if (x, colour) == (other_x, other_colour) and abs(math.log(y / other_y)) < JOINED:
                joined[i] = (x, other_y, f"{others}, {text}", colour)
                break
        else:
            joined.append((x, y, text, colour))
    return joined


def _figure(results: Values, inches: tuple[float, float]) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=inches, layout="constrained", dpi=DOTS_PER_INCH)
    FigureCanvasAgg(figure)
    width, height = results["size"]
    figure.supxlabel(
        f"{width}x{height} px on {results['device']}; reference of {results['spp']} lens points",
        fontsize=7.5,
        color="0.35",
    )
    return figure


def _legend(figure: Any, runs: list[Values], title: str, *, front_too: bool = False, slope_too: bool = False) -> None:
    from matplotlib.lines import Line2D

    views = [view for view in COLOURS if any(run["view"] == view for run in runs)]
    handles = [
        Line2D([], [], color=COLOURS[view], marker=MARKERS[view], markersize=4.5, label=LEGEND[view]) for view in views
    ]
    if front_too:
        handles.append(
            Line2D([], [], color="#f0c000", linewidth=6, alpha=0.45, label="front: none is both faster and better")
        )
    if slope_too:
        handles.append(Line2D([], [], color="black", linestyle="--", label="slope 1/√N: independent samples"))
    handles.append(Line2D([], [], color="0.5", linestyle=":", label="noise floor of the reference"))
    figure.legend(
        handles=handles, loc="outside upper center", ncols=3, fontsize=8, frameon=False, title=title, title_fontsize=12
    )


def _plain_ticks(panels: Any) -> None:
    """Numbers as one writes them, in place of powers of ten, and not so many that they touch."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for axes in (axes for row in panels for axes in row):
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(base=10, subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_minor_formatter(NullFormatter())


def _shaded(runs: list[Values]) -> Iterator[tuple[Values, float]]:
    """Each run and how opaque it is: the dearer ones of a view more."""
    for run in runs:
        alike = [other["label"] for other in runs if other["view"] == run["view"]]
        yield run, 0.35 + 0.65 * (alike.index(run["label"]) + 1) / len(alike)


def _short(run: Values) -> str:
    return next((number(value, "g") for value in run["varied"].values()), run["view"])


def _medians(run: Values) -> dict[str, float]:
    return {name: of_pass["median"] or 0.0 for name, of_pass in run["times"]["passes"].items()}


def _positive(value: float | None) -> bool:
    """Whether a logarithmic axis can show it."""
    return value is not None and math.isfinite(value) and value > 0.0


def _save(figure: Any, path: Path) -> None:
    write_atomically(path, lambda temporary: figure.savefig(temporary, dpi=DOTS_PER_INCH, format="png"))
