"""The command line: what each command takes, and errors as one sentence with an exit code."""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
import traceback
from collections.abc import Sequence
from typing import Any, NoReturn

from . import commands, info_command, plan_command, presets, tune_command
from .camera import read_viewpoint
from .errors import UserError, tell
from .frame.pipeline import VIEWS
from .scene.gallery import DEFAULT
from .settings import Settings, walk

COMMANDS = ("view", "shot", "bench", "plan", "tune", "info", "doctor", "scenes")
MAX_TIME_S = 1e6  # eleven days: a float64 still tells microseconds apart there
DEFAULT_VIEW = "hybrid"


class _Parser(argparse.ArgumentParser):
    """argparse with one sentence instead of a usage dump, and no guessing at abbreviated options."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        raise UserError(f"{message} (see {self.prog} --help)")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code. Raises KeyboardInterrupt (app/__main__.py)."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    debug = "--debug" in arguments
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # names from files may hold what a terminal's encoding cannot
            stream.reconfigure(errors="backslashreplace")
    try:
        options = _parsed(arguments)
        if "preset" in options:
            presets.resolve(options, DEFAULT_VIEW)
        if "camera" in options:
            options.viewpoint = read_viewpoint(options.camera) if options.camera else None
        module = {"plan": plan_command, "tune": tune_command, "info": info_command}.get(options.command, commands)
        code = int(getattr(module, options.command)(options) or 0)
        sys.stdout.flush()
        return code
    except UserError as error:
        if debug:
            traceback.print_exc()
        tell(str(error))
        return error.exit_code
    except BrokenPipeError:
        # The reader went away, as `| head` does; what is still buffered must not be flushed at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _parsed(arguments: list[str]) -> argparse.Namespace:
    """The options, with `view` as the command where none is named. Raises UserError."""
    if not arguments or (arguments[0] not in COMMANDS and arguments[0] not in ("-h", "--help", "--version")):
        if len(arguments) > 1 and not any(argument.startswith("-") for argument in arguments[:2]):
            raise UserError(f"there is no command {arguments[0]!r}; choose one of {', '.join(COMMANDS)}")
        arguments = ["view", *arguments]
    options, unknown = parser().parse_known_args(_joined(arguments))
    if unknown:
        raise UserError(f"{unknown[0]} is not an option here (see hybrid-dof {options.command} --help)")
    options.arguments = arguments
    return options


def _joined(arguments: list[str]) -> list[str]:
    """With `--option -4x5` as `--option=-4x5`: argparse takes for an option what begins with a dash, unless it is the
    plainest of numbers.
    """
    joined: list[str] = []
    for argument in arguments:
        if joined and re.fullmatch(r"--[\w.-]+", joined[-1]) and re.match(r"-(\.?\d|inf|nan)", argument):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def parser() -> argparse.ArgumentParser:
    """All commands and options; the settings' options come from their one definition."""
    top = _Parser(prog="hybrid-dof", description="Depth of field three ways: post-process, hybrid and ray-traced.")
    top.add_argument("--version", action="version", version=commands.version())
    subparsers = top.add_subparsers(dest="command", required=True, parser_class=_Parser)

    view = subparsers.add_parser("view", help="open the window (the default command)")
    view.add_argument("scene", nargs="?", default=DEFAULT.name, help=f"built-in name or file (default: {DEFAULT.name})")
    view.add_argument("--status", metavar="FILE", help="append a JSON line with the window's state at each change")
    view.add_argument(
        "--screenshots", metavar="DIR", default=".", help="where F12 saves pictures (default: the current folder)"
    )
    _picture_options(view, "960x540")

    shot = subparsers.add_parser("shot", help="render one picture without a window")
    shot.add_argument("scene", help="built-in name or file")
    shot.add_argument(
        "-o", "--output", required=True, metavar="FILE", help=".png (tone-mapped) or .exr (linear float32)"
    )
    shot.add_argument(
        "--frames",
        type=_count,
        default=16,
        metavar="N",
        help="frames rendered before the picture is taken (default 16)",
    )
    shot.add_argument(
        "--spp",
        type=_count,
        default=64,
        metavar="N",
        help="lens samples per pixel of traced and reference (default 64)",
    )
    shot.add_argument(
        "--time", type=_seconds, default=0.0, metavar="S", help="when the picture is taken, in s of the scene's motion"
    )
    shot.add_argument(
        "--fps",
        type=_rate,
        metavar="N",
        help="frames per second of the motion that leads up to the picture; without it time stands still",
    )
    shot.add_argument("--seed", type=_seed, default=0, metavar="N", help="of all random choices (default 0)")
    shot.add_argument("--report", metavar="FILE", help="write times, memory, device and settings as JSON")
    _picture_options(shot, "960x540")

    _bench_options(subparsers.add_parser("bench", help="accuracy against time of every view at several settings"))

    plan = subparsers.add_parser("plan", help="what would run, what would not, and why")
    plan_command.add_options(plan)
    _picture_options(plan, "960x540")

    tune = subparsers.add_parser("tune", help="the cheapest settings below an error, or the best within a frame time")
    tune_command.add_options(tune, _count, _seconds)
    _picture_options(tune, "960x540", with_view=False)

    info = subparsers.add_parser("info", help="what loading a scene saw, changed and dropped")
    info.add_argument("scene", help="built-in name or file")
    info.add_argument("--debug", action="store_true", help=argparse.SUPPRESS)
    for name, text in (("doctor", "driver, limits and the timer's self-test"), ("scenes", "list the built-in scenes")):
        subparsers.add_parser(name, help=text).add_argument("--debug", action="store_true", help=argparse.SUPPRESS)
    return top


def _picture_options(command: argparse.ArgumentParser, size: str, with_view: bool = True) -> None:
    if with_view:
        command.add_argument(
            "--view", metavar="VIEW", help=f"{', '.join(VIEWS)}, or any target's name (default {DEFAULT_VIEW})"
        )
    command.add_argument(
        "--size", type=_size, default=_size(size), metavar="WxH", help=f"picture size in px (default {size})"
    )
    command.add_argument("--camera", metavar="FILE.json", help="camera file; the scene's first camera otherwise")
    command.add_argument("--preset", metavar="FILE.json", help="settings and view from a file; options given win")
    _setting_options(command)


def _bench_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "scenes",
        nargs="*",
        metavar="SCENE",
        help="built-in name or file, or SCENE@CAMERA.json to see it by a camera file (default: all built-in scenes)",
    )
    command.add_argument("-o", "--output", metavar="DIR", help="folder for results; a benchmark begun there goes on")
    command.add_argument("--compare", nargs=2, metavar=("A", "B"), help="compare two results (bench.json or folder)")
    command.add_argument("--fresh", action="store_true", help="start over, whatever DIR holds")
    command.add_argument("--quick", action="store_true", help="a coarse pass: fewer frames, candidates and lens points")
    command.add_argument("--size", type=_size, default=(640, 360), metavar="WxH", help="in px (default 640x360)")
    for name, default, text in (
        ("frames", "16; quick: 4", "frames that a still picture accumulates; errors are read after 1, 2, 4, ..."),
        ("timed", "12; quick: 6", "frames that are timed, fewer of the dear ones"),
        ("spp", "256; quick: 64", "lens points of the reference"),
    ):
        command.add_argument(f"--{name}", type=_count, metavar="N", help=f"{text} (default {default})")
    command.add_argument("--views", metavar="V,V", help="of sharp,post,hybrid,traced (default: all)")
    for name, what in (
        ("rings", "rings of the post-process"),
        ("rays", "rays per masked pixel of the hybrid"),
        ("samples", "samples a frame of the traced view"),
    ):
        command.add_argument(f"--{name}", metavar="N,N", help=f"{what} to compare")
    command.add_argument("--seed", type=_seed, default=0, metavar="N", help="of all random choices (default 0)")
    command.add_argument(
        "--time", type=_seconds, default=0.0, metavar="S", help="when what moves stands still, in s (default 0)"
    )
    _setting_options(command)


def _setting_options(command: argparse.ArgumentParser) -> None:
    command.add_argument("--debug", action="store_true", help="show the traceback of an error")
    for path, leaf, value in walk(Settings()):
        low, high, unit = (leaf.metadata[key] for key in ("low", "high", "unit"))
        span = "" if low is None else f"{low:g} to {high:g} {unit}".strip() + ", "
        step = "" if leaf.metadata["off"] is None else f"; a step, off at {commands.shown(leaf.metadata['off'])}"
        trade = "; trades accuracy for time" if leaf.metadata["quality"] else ""
        text = f"{leaf.metadata['doc']} ({span}default {commands.shown(value)}{step}{trade})".replace("%", "%%")
        command.add_argument(f"--{path}", metavar="VALUE", help=text, dest=path)


def _count(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not 1 <= value <= 1 << 20:
        raise argparse.ArgumentTypeError(f"{text}: give a number from 1 to {1 << 20}")
    return value


def _seconds(text: str) -> float:
    return _number(text, -MAX_TIME_S, MAX_TIME_S)


def _rate(text: str) -> float:
    return _number(text, 1e-3, 1e6)


def _number(text: str, low: float, high: float) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not low <= value <= high:  # NaN fails as well
        raise argparse.ArgumentTypeError(f"{text}: give a number from {low:g} to {high:g}")
    return value


def _seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 1 << 32:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 to {(1 << 32) - 1}")
    return int(text)


def _size(text: str) -> tuple[int, int]:
    width, separator, height = text.lower().partition("x")
    if not separator or not width.isdigit() or not height.isdigit() or not int(width) or not int(height):
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 1280x720")
    return int(width), int(height)
