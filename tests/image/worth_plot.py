"""Error over cost, with the Pareto front: the views that no other beats in both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from app.files import write_atomically

PANEL_INCHES = (4.6, 3.6)
DOTS_PER_INCH = 120


class Point(NamedTuple):
    """One view of one subject."""

    label: str
    ms: float  # of a frame
    flip: float


def pareto(points: Sequence[Point]) -> list[Point]:
    """Those with less error than all that are as cheap, cheapest first."""
    front: list[Point] = []
    for point in sorted(points, key=lambda p: (p.ms, p.flip)):
        if not front or point.flip < front[-1].flip:
            front.append(point)
    return front


def plot(panels: Mapping[str, Sequence[Point]], device: str, path: Path) -> None:
    """One panel a subject: mean FLIP over milliseconds per frame, written as a PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    width, height = PANEL_INCHES
    figure = Figure(figsize=(width * len(panels), height), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (subject, points) in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels.items(), strict=True):
        front = pareto(points)
        axes.plot([p.ms for p in front], [p.flip for p in front], color="0.6", zorder=1)
        for point in points:
            axes.scatter(point.ms, point.flip, color="tab:blue" if point in front else "tab:gray", zorder=2)
            axes.annotate(point.label, (point.ms, point.flip), (4, 4), textcoords="offset points", fontsize=8)
        axes.set(xscale="log", title=subject, xlabel="ms per frame", ylabel="mean FLIP")
        axes.margins(x=0.2, y=0.1)
        axes.set_ylim(bottom=0.0)
        axes.xaxis.set_major_formatter(ScalarFormatter())
        axes.xaxis.set_minor_formatter(NullFormatter())
    figure.suptitle(device, fontsize=8)
    write_atomically(path, lambda temporary: figure.savefig(temporary, dpi=DOTS_PER_INCH, format="png"))
