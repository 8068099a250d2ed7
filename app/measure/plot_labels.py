"""Labels beside points, where they cover neither each other nor points, as far as there is room."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

Label = tuple[float, float, str, str]  # where in the data, what, which colour
Box = tuple[float, float, float, float]  # left, bottom, right, top [px]

DIRECTIONS = [math.radians(angle) for angle in (45, 0, 90, 135, -45, -90, 180, -135)]  # in order of preference
DISTANCES_PT = (5.0, 10.0, 17.0, 26.0)
LEADER_FROM_PT = 9.0  # a label farther away is tied to its point by a line
POINT_PT = 3.0  # half the width of what a point covers
PASSED = 24  # points along a piece of a line that labels shun as well


def place(figure: Any, axes: Any, points: Sequence[Label], lines: Sequence[Any]) -> None:
    """Write each label beside its point. Call it last: limits and layout must not change afterwards.

    `lines` are sequences of points that are joined; labels shun them too.
    """
    renderer = figure.canvas.get_renderer()
    scale = figure.dpi / 72.0
    shift, frame = axes.transData.transform, axes.get_window_extent(renderer)
    at = [tuple(shift((x, y))) for x, y, *_ in points]
    taken: list[Box] = [_around(p, POINT_PT * scale) for p in at]
    along = [p for line in lines for a, b in pairwise([tuple(shift(q)) for q in line]) for p in _between(a, b)]
    legend = axes.get_legend()
    if legend is not None:
        extent = legend.get_window_extent(renderer)
        taken.append((extent.x0, extent.y0, extent.x1, extent.y1))
    for (x, y, text, colour), point in zip(points, at, strict=True):
        label = axes.annotate(
            text, (x, y), (0, 0), textcoords="offset points", fontsize=7.5, color=colour, ha="center", va="center"
        )
        extent = label.get_window_extent(renderer)
        width, height = extent.width, extent.height
        best, cost = (0.0, 0.0), math.inf
        for distance in DISTANCES_PT:
            for preference, angle in enumerate(DIRECTIONS):
                offset = (
                    math.cos(angle) * (distance * scale + width / 2),
                    math.sin(angle) * (distance * scale + height / 2),
                )
                box = _box(point[0] + offset[0], point[1] + offset[1], width, height)
                outside = _area(box) - _overlap(box, (frame.x0, frame.y0, frame.x1, frame.y1))
                covered = sum(_overlap(box, other) for other in taken) + 4 * outside
                crossed = 6 * sum(_overlap(box, _around(p, 1.0)) for p in along)
                if (new := covered + crossed + distance + 0.3 * preference) < cost:
                    best, cost = offset, new
        taken.append(_box(point[0] + best[0], point[1] + best[1], width, height))
        label.set_position((best[0] / scale, best[1] / scale))
        gap_pt = (math.hypot(max(abs(best[0]) - width / 2, 0), max(abs(best[1]) - height / 2, 0))) / scale
        if gap_pt > LEADER_FROM_PT:
            axes.annotate(
                "",
                (x, y),
                (best[0] / scale, best[1] / scale),
                textcoords="offset points",
                arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.5, "shrinkA": 6, "shrinkB": 3},
            )


def _between(a: tuple[float, ...], b: tuple[float, ...]) -> list[tuple[float, float]]:
    return [(a[0] + (b[0] - a[0]) * i / PASSED, a[1] + (b[1] - a[1]) * i / PASSED) for i in range(1, PASSED)]


def _around(point: tuple[float, ...], half: float) -> Box:
    return point[0] - half, point[1] - half, point[0] + half, point[1] + half


def _box(x: float, y: float, width: float, height: float) -> Box:
    return x - width / 2, y - height / 2, x + width / 2, y + height / 2


def _area(box: Box) -> float:
    return (box[2] - box[0]) * (box[3] - box[1])


def _overlap(a: Box, b: Box) -> float:
    wide, high = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return wide * high if wide > 0 and high > 0 else 0.0
