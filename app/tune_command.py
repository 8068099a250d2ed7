"""The command `tune`: settings that keep an error or a frame time, searched for, verified and saved as a preset."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import commands
from .errors import NOT_REACHED, UserError
from .measure.regions import REGIONS

if TYPE_CHECKING:
    from .measure.goal import Figures
    from .measure.trial import Judge
    from .measure.tune import Advice, Progress, Tuning

HEADER = f"{'ms':>9}{'error':>9}  {'keeps it':<10}view and settings"


def add_options(command: argparse.ArgumentParser, count: Any, seconds: Any) -> None:
    """What `tune` takes beside the options of a picture; `count` and `seconds` read numbers."""
    command.add_argument("scene", help="built-in name or file")
    goal = command.add_mutually_exclusive_group(required=True)
    goal.add_argument("--error", type=_positive, metavar="E", help="find the cheapest settings below this error")
    goal.add_argument(
        "--ms", type=_positive, metavar="M", help="find the most accurate settings below these milliseconds a frame"
    )
    command.add_argument("-o", "--output", metavar="PRESET.json", help="save what was found as a preset")
    command.add_argument(
        "--metric", choices=("flip", "rmse"), default="flip", help="what error means (default flip: its mean)"
    )
    command.add_argument("--region", choices=("whole", *REGIONS), default="whole", help="where (default whole)")
    command.add_argument(
        "--frames", type=count, default=16, metavar="N", help="the error is that after N still frames (default 16)"
    )
    command.add_argument(
        "--spp", type=count, default=256, metavar="N", help="lens points of the reference, an even number (default 256)"
    )
    command.add_argument(
        "--views", type=_names, default=None, metavar="V,V", help="which to choose from (default: all but reference)"
    )
    command.add_argument(
        "--steps", type=count, default=48, metavar="N", help="most candidates that the search measures (default 48)"
    )
    command.add_argument(
        "--time", type=seconds, default=0.0, metavar="S", help="the moment, in s of the scene's motion (default 0)"
    )


def tune(options: argparse.Namespace) -> int:
    """Search, verify, say, save."""
    from .camera import Moment
    from .gpu.context import device_name, headless_context
    from .measure.reference import reference
    from .measure.store import scene_digest
    from .measure.trial import Judge, check_metric
    from .measure.tune import VIEWS, Tuning, check_views
    from .renderer import Renderer
    from .scene.load import scene_file
    from .session import load_gpu_scene

    views = options.views or VIEWS
    check_views(views)
    check_metric(options.metric)
    if options.spp % 2:
        raise UserError(f"--spp {options.spp}: give an even number, since a reference is two halves that are compared")
    output = _checked(options.output) if options.output else None
    fixed = commands.optional_settings(options)
    scene_file(options.scene)
    ctx = headless_context()
    scene, gpu_scene = load_gpu_scene(ctx, options.scene, commands.show_progress)
    box = gpu_scene.facts.low, gpu_scene.facts.high
    viewpoint, settings = commands.start_of(options, scene, box, commands.given_settings(options))
    renderer = Renderer(ctx, gpu_scene, options.size, share_memory=True)
    renderer.progress_callback = commands.show_progress
    moment = Moment(viewpoint.camera, options.time)
    truth = reference(
        ctx,
        renderer,
        viewpoint.camera,
        settings,
        options.spp,
        scene=scene_digest(scene),
        time_s=options.time,
        progress=commands.show_progress,
    )
    judge = Judge(truth, options.metric, options.region)
    tuning = Tuning(
        ctx,
        renderer,
        moment,
        settings,
        judge,
        error=options.error,
        ms=options.ms,
        frames=options.frames,
        fixed=fixed,
        views=views,
        limit=options.steps,
    )
    print(_heading(options, tuning, judge, device_name(ctx), renderer.profiler.source))
    print(HEADER)
    advice = _driven(tuning)
    _answer(options, advice, output, device_name(ctx), renderer.profiler.source)
    return 0


def _driven(tuning: Tuning) -> Advice:
    """Run it to its end, a line for each candidate, what it may still take on a terminal."""
    from .measure.bench_progress import duration

    steps = tuning.run()
    stage = "search"
    while True:
        try:
            progress = next(steps)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]
        if progress.figures:
            _progress_line("")
            if progress.stage != stage:
                stage = progress.stage
                print("measured again with another seed and more frames; the worse error counts:")
            print(_row(progress, progress.figures), flush=True)
        else:
            left = "" if math.isnan(progress.left_s) else f", at most {duration(progress.left_s)} left"
            _progress_line(f"{progress.stage}: {progress.done} of at most {progress.most} candidates{left}")


def _heading(options: argparse.Namespace, tuning: Tuning, judge: Judge, device: str, source: str) -> str:
    wanted = (
        f"cheapest settings with {_metric(options)} below {options.error:g}"
        if options.error is not None
        else f"most accurate settings below {options.ms:g} ms a frame"
    )
    width, height = options.size
    return (
        f"{options.scene} at {width}x{height}: {wanted}\n"
        f"error: {_metric(options)} after {options.frames} still frames, against {options.spp} lens points, whose own "
        f"noise is {tuning.goal.floor:.4g}\ntime: median of a frame, {source}, {device}"
    )


def _row(progress: Progress, figures: Figures) -> str:
    error = "" if math.isnan(figures.error) else f"{figures.error:.4g}"
    kept = "yes" if progress.kept else "no" if error else "too slow"
    return f"{figures.ms:>9.2f}{error:>9}  {kept:<10}{progress.candidate.label}"


def _answer(options: argparse.Namespace, advice: Advice, output: Path | None, device: str, source: str) -> None:
    """Say the promise and save it. Raises UserError(exit code 1) with the closest where there is none."""
    from .measure.tune import preset_values
    from .presets import Preset, write_preset

    width, height = options.size
    figures, label = advice.figures, advice.candidate.label
    sure = "" if math.isnan(figures.high_ms) else f"; at most {figures.high_ms:.2f} with 95 % confidence"
    took = f"{figures.ms:.2f} ms a frame (median{sure})"
    error = "an unknown error" if math.isnan(figures.error) else f"{_metric(options)} {figures.error:.4g}"
    if not advice.kept:
        limit = f"an error below {options.error:g}" if options.error is not None else f"less than {options.ms:g} ms"
        nothing = f" and {output} was not written" if output else ""
        raise UserError(
            f"none of {advice.measured} candidates keeps {limit}{nothing}; the closest is {label}: {error}, {took}",
            NOT_REACHED,
        )
    where = f"{width}x{height}, {source}, {device}"
    print(f"\n{label}\n{error} after {options.frames} frames, {took}\nat {where}")
    if output:
        about = {
            "promise": f"{error} after {options.frames} still frames, {took}",
            "device": device,
            "timing_source": source,
            "size": [width, height],
            "scene": options.scene,
            "time": options.time,
            "reference_spp": options.spp,
            "version": commands.version(),
        }
        values = preset_values(advice.candidate, commands.given_settings(options))
        write_preset(output, Preset(advice.candidate.view, values), about)
        print(f"saved {output}")


def _metric(options: argparse.Namespace) -> str:
    name = {"flip": "mean FLIP", "rmse": "RMSE"}[options.metric]
    return name if options.region == "whole" else f"{name} over {options.region}"


def _checked(text: str) -> Path:
    """The path if a preset can be written there. Raises UserError before any time is spent."""
    from .files import check_folder, is_folder, user_path
    from .presets import SUFFIX

    path = user_path(text)
    if path.suffix.lower() != SUFFIX:
        raise UserError(f"-o {path}: name a file ending in {SUFFIX}")
    check_folder(path, "-o")
    if is_folder(path):
        raise UserError(f"-o {path} is a folder; name a file")
    return path


def _progress_line(text: str) -> None:
    """Rewritten in place on a terminal; nothing elsewhere."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}: give a number above 0")
    return value


def _names(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(part.strip() for part in text.split(",")))
