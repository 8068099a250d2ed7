"""What each view costs and how wrong it is: `python -m tests.image.worth [SUBJECT ...] [-o FILE.md] [--plot FILE.png]`.

Error is mean FLIP against the raster reference, over the picture and where pixels see both sides of a blurred
silhouette; time is the median of one frame. The traced view adds 1, 2, 4, 8 lens samples a frame.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import moderngl

from app.gpu.context import device_name, headless_context
from app.measure.metrics import WHOLE
from app.picture import write_json
from app.settings import Settings, put

from .markdown import number, ratio, table
from .options import check_outputs, chosen, parser, report
from .references import reference
from .scores import BOTH_SIDES, BOTH_SIDES_MEANS, Score, scored
from .subjects import Subject
from .worth_plot import Point, plot

TRACED_SAMPLES = (1, 2, 4, 8)  # a frame

HEADER = (
    "subject", "view", "FLIP", "both sides", "ms", "FLIP / post", "both sides / post", "ms / post", "masked",
    "rays a masked pixel",
)  # fmt: skip


@dataclass(frozen=True)
class Result:
    """All views of one subject, by label."""

    subject: str
    noise: float  # FLIP that a picture without error would show beside the reference
    both_sides: float  # share of the pixels
    scores: dict[str, Score]


def views(settings: Settings) -> Iterator[tuple[str, str, Settings]]:
    """(label, view, settings) of all that is compared."""
    for view in ("sharp", "post", "hybrid"):
        yield view, view, settings
    for samples in TRACED_SAMPLES:
        yield f"traced {samples}", "traced", put(settings, "rays.samples_per_frame", samples)


def measured(
    ctx: moderngl.Context, subject: Subject, size: tuple[int, int], frames: int, spp: int, rounds: int = 1
) -> Result:
    """One subject in every view, timed in so many rounds: what else the machine does changes by the minute."""
    stage = subject.opened(ctx)
    truth = reference(ctx, stage, subject.digest(), size, spp)
    taken = [
        {label: scored(ctx, stage, view, size, frames, truth, used) for label, view, used in views(stage.settings)}
        for _ in range(rounds)
    ]
    scores = {label: replace(score, ms=min(others[label].ms for others in taken)) for label, score in taken[0].items()}
    return Result(subject.name, truth.floor[WHOLE].flip, float(truth.regions[BOTH_SIDES].mean()), scores)


def rows(result: Result) -> list[list[str]]:
    """A row of the table for each view."""
    post = result.scores["post"]
    return [
        [
            result.subject,
            label,
            number(s.error.whole, ".4f"),
            number(s.error.both_sides, ".4f"),
            number(s.ms, ".1f"),
            ratio(s.error.whole, post.error.whole),
            ratio(s.error.both_sides, post.error.both_sides),
            ratio(s.ms, post.ms),
            number(s.masked, ".1%"),
            number(s.rays, ".2f"),
        ]
        for label, s in result.scores.items()
    ]


def described(results: list[Result], device: str, size: tuple[int, int], frames: int, spp: int) -> str:
    """The table, and what one must know to read it."""
    about = (
        f"Mean FLIP after {frames} frames at {size[0]}x{size[1]} against {spp} rasterised lens points; median "
        f"wall-clock milliseconds of a frame after glFinish, on {device}. {BOTH_SIDES_MEANS} "
        "Traced: with so many new lens samples a frame."
    )
    notes = (
        f"* {r.subject}: {r.both_sides:.1%} of the pixels see both sides; noise of the reference: FLIP {r.noise:.4f}"
        for r in results
    )
    return "\n".join([about, "", table(HEADER, [row for result in results for row in rows(result)]), "", *notes])


def values(result: Result) -> dict[str, object]:
    """One subject's figures as JSON holds them."""
    scores = [
        {
            "view": label,
            "flip": s.error.whole,
            "flip_both_sides": finite(s.error.both_sides),
            "ms": s.ms,
            "masked": finite(s.masked),
            "rays_per_masked_pixel": finite(s.rays),
        }
        for label, s in result.scores.items()
    ]
    return {
        "subject": result.subject,
        "reference_flip": result.noise,
        "both_sides": result.both_sides,
        "views": scores,
    }


def finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def main(arguments: list[str] | None = None) -> int:
    options = parser("worth", __doc__)
    options.add_argument("--rounds", type=int, default=1, help="of timing, of which the fastest counts (default: 1)")
    options.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    options.add_argument("--plot", type=Path, metavar="FILE.png", help="draw error over milliseconds there")
    given = options.parse_args(arguments)
    check_outputs(options, given.output, given.json, given.plot)
    subjects = chosen(options, given.subjects)
    if not subjects:
        return 0
    ctx = headless_context()
    results = [measured(ctx, subject, given.size, given.frames, given.spp, given.rounds) for subject in subjects]
    report(described(results, device_name(ctx), given.size, given.frames, given.spp), given.output)
    if given.json:
        about = {"device": device_name(ctx), "size": given.size, "frames": given.frames, "spp": given.spp}
        write_json(given.json, {**about, "subjects": [values(result) for result in results]})
    if given.plot:
        panels = {r.subject: [Point(label, s.ms, s.error.whole) for label, s in r.scores.items()] for r in results}
        plot(panels, device_name(ctx), given.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
