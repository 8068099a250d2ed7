"""The command `plan`: what would run, what would not, and why; measured if asked for."""

from __future__ import annotations

import argparse
from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Any

from . import commands

if TYPE_CHECKING:
    from .frame.records import FramePlan
    from .measure.savings import Costs
    from .scene.facts import Facts
    from .settings import Settings

NAME_WIDTH = 21  # of the longest pass' name, and a space


def add_options(parser: argparse.ArgumentParser) -> None:
    """Beside scene, view, size and settings."""
    parser.add_argument("scene", help="built-in name or file")
    parser.add_argument(
        "--measure",
        action="store_true",
        help="draw it, and tell what each pass costs and what each that is left out would",
    )
    parser.add_argument("--explain", action="store_true", help="say what each pass is for")
    parser.add_argument(
        "--programs",
        action="store_true",
        help="list the shader programs, those of this frame and those that the next step can ask for",
    )


def plan(options: argparse.Namespace) -> int:
    """Say what would run, what would not, and why, and what it takes in memory. Needs a GPU only to measure."""
    from .frame.memory import memory_lines
    from .frame.pipeline import frame_plan
    from .scene.facts import facts_of, frame_facts, near_plane
    from .scene.flatten import bounds
    from .session import open_scene

    scene, triangles = open_scene(options.scene, commands.show_progress)
    box = bounds(triangles)
    viewpoint, settings = commands.start_of(options, scene, box, commands.given_settings(options))
    of_scene = facts_of(scene, triangles)
    facts = frame_facts(
        of_scene,
        viewpoint.camera,
        settings.lens,
        options.size,
        near_plane(*box),
        objects_moved=of_scene.objects and not options.measure,  # while it plays
    )
    frame = frame_plan(options.view, settings, facts)
    print(
        f"{options.view} of {options.scene} at {options.size[0]}x{options.size[1]}: "
        f"aperture {settings.lens.aperture:g} m, focus {settings.lens.focus_distance:g} m"
    )
    print(_circles(facts, settings.post.max_coc * options.size[1], any(c.step.name == "gather" for c in frame.calls)))
    lines = _measured(options, scene, triangles, viewpoint, settings) if options.measure else _planned(frame)
    print(*(f"  {line}" for line in lines), sep="\n")
    if options.explain:
        print("what each is for:", *_purposes(frame), sep="\n  ")
    if options.programs:
        print(*_programs(options.view, settings, facts), sep="\n  ")
    print("memory of the frame, targets that share a texture together:", *memory_lines(frame, options.size), sep="\n  ")
    return 0


def _circles(facts: Facts, most_px: float, gathered: bool) -> str:
    """How large circles of confusion can get in this view, and what the post-process makes of them."""
    said = (
        f"circles of confusion reach {facts.near_coc_px:.1f} px in front of focus "
        f"and {facts.far_coc_px:.1f} px behind it (radius)"
    )
    if gathered and max(facts.near_coc_px, facts.far_coc_px) > most_px:
        said += f"; the post-process draws those beyond {most_px:.0f} px at that size (post.max_coc)"
    return said


def _planned(frame: FramePlan) -> list[str]:
    """A line per pass: its reason, and those of its defines that its shader asks for."""
    from .gpu.shaders import canonical, load_glsl

    lines, files = [], load_glsl()
    for call in frame.calls:
        _, asked, _ = canonical((call.step.shader, call.defines, ()), files)
        defines = " ".join(f"{name}={value}" for name, value in asked if value)
        lines.append(f"runs   {call.step.name:<{NAME_WIDTH}}{call.reason}{'; ' + defines if defines else ''}")
    return lines + [f"skips  {skipped.name:<{NAME_WIDTH}}{skipped.reason}" for skipped in frame.skipped]


def _purposes(frame: FramePlan) -> list[str]:
    """A line per pass, those that do not run included."""
    from .gpu.purpose import purpose

    shaders = [(call.step.name, call.step.shader) for call in frame.calls]
    shaders += [(left.name, left.shader) for left in frame.skipped]
    return [f"{name:<{NAME_WIDTH}}{purpose(shader)}" for name, shader in shaders]


def _programs(view: str, settings: Settings, facts: Facts) -> list[str]:
    """What a window would have compiled: a line per shader, with the sum before them."""
    from .gpu.programs import MOST_PROGRAMS
    from .gpu.reachable import of_frame, reachable
    from .gpu.shaders import load_glsl

    files = load_glsl()
    now, next_step = (Counter(key[0] for key in f(view, settings, facts, files)) for f in (of_frame, reachable))
    head = (
        f"shader programs: {now.total()} in this frame, {next_step.total()} within one step of it (another view, "
        f"camera or lens, one setting changed, any target); a window keeps at most {MOST_PROGRAMS}"
    )
    titles = f"{'':<28}{'now':>4}{'next':>6}"
    return [head, titles, *(f"{shader:<28}{now[shader]:4}{next_step[shader]:6}" for shader in sorted(next_step))]


def _measured(options: argparse.Namespace, scene: Any, triangles: Any, viewpoint: Any, settings: Any) -> list[str]:
    from .camera import Moment
    from .gpu.context import device_name, headless_context
    from .measure.savings import measuring
    from .measure.steps import driven
    from .renderer import Renderer
    from .session import on_gpu

    ctx = headless_context()
    gpu_scene = on_gpu(ctx, scene, triangles)
    renderer = Renderer(ctx, gpu_scene, options.size, share_memory=True)
    renderer.progress_callback = commands.show_progress
    steps = measuring(ctx, renderer, options.view, Moment(viewpoint.camera, 0.0), settings)
    try:
        costs = driven(steps, partial(commands.show_progress, "measuring"))
        return [*cost_lines(costs), f"on {device_name(ctx)}, {renderer.profiler.source}"]
    finally:
        renderer.release()
        gpu_scene.release()


def cost_lines(costs: Costs) -> list[str]:
    """A line per pass: its cost, or what leaving it out saves, and the reason; then the sum."""
    lines = []
    for cost in costs.passes:
        state, figure = ("runs", f"      {cost.ms:8.2f} ms") if cost.ms is not None else ("skips", " " * 17)
        if cost.ms is None and cost.full_ms is not None:
            figure = f"saves {cost.saved_ms:8.2f} ms"
        lines.append(f"{state:<7}{cost.name:<{NAME_WIDTH}}{figure}   {cost.reason}")
    saved = 100.0 * (1.0 - costs.ms / costs.full_ms) if costs.full_ms else 0.0
    return [*lines, f"{costs.ms:.2f} ms; with every effect on {costs.full_ms:.2f} ms: {saved:.0f} % saved"]
