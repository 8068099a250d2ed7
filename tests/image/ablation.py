"""What each step of the technique is for: `python -m tests.image.ablation [SUBJECT ...] [-o FILE.md] [--pictures DIR]`.

Every setting marked `off=` in app/settings.py is switched off alone: in a still view, and in motion where the subject
has any, since the steps that follow motion do nothing without it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np

from app.gpu.context import device_name, headless_context
from app.measure.metrics import displayed
from app.picture import write_png
from app.settings import Settings, put, steps

from .comparison import contact_sheet
from .markdown import NOTHING, number, table
from .moving import SPP, Ride, along, instants
from .options import check_outputs, chosen, parser, report
from .paths import checked, moments
from .references import reference
from .scores import BOTH_SIDES_MEANS, WARM_UP, Score, mean_error, scored
from .subjects import Subject

ALL_ON, PLAIN = "all on", "post-process"
ZOOM, COLUMNS = 2, 4  # of the contact sheets

HEADER = ("subject", "switched off", "FLIP", "both sides", "ms", "FLIP moving", "both sides moving", "ms moving")


@dataclass(frozen=True)
class Row:
    """One variant of one subject."""

    label: str
    still: Score
    moving: Ride | None


@dataclass(frozen=True)
class Ablated:
    """All variants of one subject."""

    subject: Subject
    rows: list[Row]
    truth: np.ndarray  # (h, w, 3) linear: the reference of the still view


def variants(settings: Settings) -> Iterator[tuple[str, str, Settings]]:
    """(label, view, settings): everything on, each step off, and the plain post-process."""
    yield ALL_ON, "hybrid", settings
    for path, off in steps(settings):
        yield path, "hybrid", put(settings, path, off)
    yield PLAIN, "post", settings


@dataclass(frozen=True)
class Extent:
    """How much is drawn."""

    size: tuple[int, int]
    frames: int  # of the still view
    spp: int  # lens points of its reference
    path_frames: int
    every: int  # frames from one comparison to the next
    moving_spp: int


def ablated(ctx: moderngl.Context, subject: Subject, extent: Extent) -> Ablated:
    """One subject."""
    stage, size = subject.opened(ctx), extent.size
    truth = reference(ctx, stage, subject.digest(), size, extent.spp)
    path = moments(subject, stage, extent.path_frames) if subject.moves else []
    judged = checked(extent.path_frames, extent.every) if path else []
    truths = instants(ctx, subject, stage, size, path, judged, extent.moving_spp)
    rows = []
    for label, view, settings in variants(stage.settings):
        still = scored(ctx, stage, view, size, extent.frames, truth, settings)
        ride = None
        if path:
            along(ctx, stage, view, size, path[:WARM_UP], {}, settings)  # compiles what only motion needs
            ride = along(ctx, stage, view, size, path, truths, settings)
        rows.append(Row(label, still, ride))
    return Ablated(subject, rows, truth.picture)


def cells(result: Ablated) -> list[list[str]]:
    """A row of the table for each variant."""
    return [[result.subject.name, row.label, *still_cells(row.still), *moving_cells(row.moving)] for row in result.rows]


def still_cells(score: Score) -> list[str]:
    return [number(score.error.whole, ".4f"), number(score.error.both_sides, ".4f"), number(score.ms, ".1f")]


def moving_cells(ride: Ride | None) -> list[str]:
    if ride is None:
        return [NOTHING] * 3
    mean = mean_error(list(ride.errors.values()))
    return [number(mean.whole, ".4f"), number(mean.both_sides, ".4f"), number(ride.ms, ".1f")]


def described(results: list[Ablated], device: str, extent: Extent) -> str:
    """The table, and what one must know to read it."""
    width, height = extent.size
    about = (
        f"The hybrid with one step switched off at a time, at {width}x{height}. Mean FLIP of a still view after "
        f"{extent.frames} frames against {extent.spp} rasterised lens points, and in motion, every {extent.every} of "
        f"{extent.path_frames} frames, against {extent.moving_spp}; median wall-clock milliseconds of a frame after "
        f"glFinish, on {device}. {BOTH_SIDES_MEANS}"
    )
    return "\n".join([about, "", table(HEADER, [line for result in results for line in cells(result)])])


def sheets(result: Ablated, size: tuple[int, int]) -> Iterator[tuple[str, np.ndarray]]:
    """(name, contact sheet) of the still and, if there are any, of the moving pictures, the latter without a truth."""
    name, detail = result.subject.name, result.subject.detail_px(size)
    labels = [row.label if row.label in (ALL_ON, PLAIN) else f"without {row.label}" for row in result.rows]
    shown = [displayed(result.truth), *(row.still.picture for row in result.rows)]
    yield name, contact_sheet(shown, ["reference", *labels], detail, ZOOM, COLUMNS)
    rides = [row.moving.picture for row in result.rows if row.moving]
    if rides:
        yield f"{name}-moving", contact_sheet(rides, labels, detail, ZOOM, COLUMNS)


def main(arguments: list[str] | None = None) -> int:
    options = parser("ablation", __doc__)
    options.add_argument("--path-frames", type=int, default=60, help="of the motion (default: 60)")
    options.add_argument("--every", type=int, default=10, help="frames from one comparison to the next (default: 10)")
    options.add_argument("--pictures", type=Path, metavar="DIR", help="put a contact sheet of each subject there")
    given = options.parse_args(arguments)
    check_outputs(options, given.output, given.pictures)
    subjects = chosen(options, given.subjects)
    if not subjects:
        return 0
    ctx = headless_context()
    extent = Extent(given.size, given.frames, given.spp, given.path_frames, given.every, min(given.spp, SPP))
    results = [ablated(ctx, subject, extent) for subject in subjects]
    report(described(results, device_name(ctx), extent), given.output)
    if given.pictures:
        given.pictures.mkdir(exist_ok=True)
        about = {"device": device_name(ctx), "size": given.size, "frames": given.frames}
        for name, sheet in (named for result in results for named in sheets(result, given.size)):
            write_png(given.pictures / f"{name}.png", sheet, about)
    return 0


if __name__ == "__main__":
    sys.exit(main())
