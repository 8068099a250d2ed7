"""How a view does in motion: `python -m tests.image.moving [SUBJECT ...] [--view hybrid] [-o FILE.md]`.

Along a scripted path the picture is compared, every 10 frames, with the raster reference of that instant, and with what
the same view shows there when it stands still. Then the motion stops, and the picture is watched as it settles.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import moderngl
import numpy as np

from app.camera import Moment
from app.frame.pipeline import VIEWS
from app.gpu.context import device_name, headless_context
from app.measure.metrics import WHOLE
from app.measure.reference import Reference
from app.settings import Settings

from .markdown import number, ratio, table
from .options import check_outputs, chosen, parser, report
from .paths import checked, moments
from .references import reference
from .scores import BOTH_SIDES_MEANS, WARM_UP, Error, error, mean_error, median_ms, timed
from .stage import Stage
from .steadiness import AGE, TRAIL_FRAME, WATCHED, Settling, flicker, settling
from .subjects import IN_MOTION, Subject

SPP = 256  # of an instant's reference: half the noise of 64, and affordable at every tenth frame

HEADER = (
    "subject", "view", "FLIP moving", "both sides", "FLIP still", "both sides", "moving / still", "ms", "settles after",
    "afresh", "trail", "afresh", "flicker",
)  # fmt: skip


@dataclass(frozen=True)
class Ride:
    """A view along a path."""

    errors: dict[int, Error]  # by frame
    ms: float  # median of a frame
    picture: np.ndarray  # (h, w, 3) uint8, the last judged frame as displayed


@dataclass(frozen=True)
class Motion:
    """All that is told of one view of one subject."""

    subject: str
    view: str
    ride: Ride
    still: dict[int, Error]  # at the same instants, after standing still there
    settling: Settling
    flicker: float  # levels of 255
    noise: float  # FLIP that pictures without error would show beside the references, mean


def instants(
    ctx: moderngl.Context,
    subject: Subject,
    stage: Stage,
    size: tuple[int, int],
    path: list[Moment],
    judged: list[int],
    spp: int,
) -> dict[int, Reference]:
    """The reference of each judged frame."""
    scene = subject.digest()
    return {k: reference(ctx, stage, scene, size, spp, path[k]) for k in judged}


def along(
    ctx: moderngl.Context,
    stage: Stage,
    view: str,
    size: tuple[int, int],
    path: list[Moment],
    truths: dict[int, Reference],
    settings: Settings | None = None,
) -> Ride:
    """Draw a view along a path, and judge it where there is a reference."""
    errors, times, picture = {}, [], np.zeros((0, 0, 3), np.uint8)
    for k, (renderer, ms) in enumerate(timed(ctx, stage.frames(view, size, path, settings=settings))):
        times.append(ms)
        if k in truths:
            errors[k], picture = error(renderer, truths[k]), renderer.picture()
    return Ride(errors, median_ms(times), picture)


def standing(
    stage: Stage, view: str, size: tuple[int, int], frames: int, path: list[Moment], truths: dict[int, Reference]
) -> dict[int, Error]:
    """The view's error where it stands still for some frames instead of passing by."""
    return {
        k: error(stage.draw(view, size, frames=frames, camera=path[k].camera, time_s=path[k].time_s), truth)
        for k, truth in truths.items()
    }


def measured(
    ctx: moderngl.Context,
    subject: Subject,
    view: str,
    size: tuple[int, int],
    frames: int,
    path_frames: int,
    every: int,
    spp: int,
) -> Motion:
    """One view of one subject."""
    stage = subject.opened(ctx)
    path = moments(subject, stage, path_frames)
    truths = instants(ctx, subject, stage, size, path, checked(path_frames, every), spp)
    along(ctx, stage, view, size, path[:WARM_UP], {})  # a moving view's programs are compiled before it is timed
    return Motion(
        subject.name,
        view,
        along(ctx, stage, view, size, path, truths),
        standing(stage, view, size, frames, path, truths),
        settling(stage, view, size, path),
        flicker(stage, view, size, path[0]),
        float(np.mean([truth.floor[WHOLE].flip for truth in truths.values()])),
    )


def row(motion: Motion) -> list[str]:
    """Its row of the table."""
    moving, still = (mean_error(list(errors.values())) for errors in (motion.ride.errors, motion.still))
    settled = motion.settling
    return [
        motion.subject,
        motion.view,
        number(moving.whole, ".4f"),
        number(moving.both_sides, ".4f"),
        number(still.whole, ".4f"),
        number(still.both_sides, ".4f"),
        ratio(moving.whole, still.whole),
        number(motion.ride.ms, ".1f"),
        waited(settled.frames),
        waited(settled.fresh_frames),
        number(settled.trail, ".2%"),
        number(settled.fresh_trail, ".2%"),
        number(motion.flicker, ".2f"),
    ]


def waited(frames: int | None) -> str:
    return f"> {WATCHED}" if frames is None else str(frames)


def described(
    motions: list[Motion], device: str, size: tuple[int, int], frames: int, path_frames: int, spp: int
) -> str:
    """The tables, and what one must know to read them."""
    about = (
        f"{path_frames} frames in motion at {size[0]}x{size[1]}; mean FLIP against {spp} rasterised lens points, "
        f"moving and after {frames} frames of standing still at the same instants; median wall-clock milliseconds of a "
        f"moving frame; on {device}. {BOTH_SIDES_MEANS} Settles: frames after the stop until 99 % of the pixels are "
        f"within 2/255 of the converged picture, or as near to it as the view drawn afresh gets in {AGE} frames; "
        f"afresh: the same view that never moved. Trail: pixels more than 2/255 off, {TRAIL_FRAME} frames after the "
        "stop. Flicker: deviation over time of a still view, 99th percentile, in 1/255."
    )
    over_time = (
        f"* {m.subject}, {m.view}, by frame: "
        + ", ".join(f"{k + 1}: {e.whole:.4f}" for k, e in m.ride.errors.items())
        + f"; noise of the references: {m.noise:.4f}"
        for m in motions
    )
    return "\n".join([about, "", table(HEADER, [row(motion) for motion in motions]), "", *over_time])


def main(arguments: list[str] | None = None) -> int:
    options = parser("moving", __doc__, spp=SPP)
    options.add_argument("--view", action="append", choices=list(VIEWS), help="again for more (default: hybrid)")
    options.add_argument("--path-frames", type=int, default=60, help="of the motion (default: 60)")
    options.add_argument("--every", type=int, default=10, help="frames from one comparison to the next (default: 10)")
    given = options.parse_args(arguments)
    check_outputs(options, given.output)
    subjects = chosen(options, given.subjects, IN_MOTION)
    if not subjects:
        return 0
    ctx = headless_context()
    motions = [
        measured(ctx, subject, view, given.size, given.frames, given.path_frames, given.every, given.spp)
        for subject in subjects
        for view in given.view or ["hybrid"]
    ]
    device = device_name(ctx)
    report(described(motions, device, given.size, given.frames, given.path_frames, given.spp), given.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
