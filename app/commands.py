"""What the commands do once their options are parsed. Heavy imports happen inside, so that `--help` comes at once."""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import asdict
from importlib import metadata
from typing import Any

from .camera import Viewpoint, camera_values
from .settings import Settings, parse, plain, put, to_dict, walk

# lens samples per dispatch of a headless picture: long enough to keep the device busy, short enough for its watchdog
TRACE_BATCH = 4


def version() -> str:
    """The installed version."""
    try:
        return metadata.version("hybrid-dof")
    except metadata.PackageNotFoundError:
        return "0+checkout"


def shown(value: Any) -> str:
    """A setting's value as it would be typed."""
    value = plain(value)
    if isinstance(value, list):
        return ",".join(f"{x:g}" for x in value)
    return ("off", "on")[value] if isinstance(value, bool) else str(value)


def given_settings(options: argparse.Namespace) -> dict[str, Any]:
    """{dotted path: value} of the settings that were given by a preset or, which wins, as options. Raises UserError for
    a bad value.
    """
    preset = getattr(options, "preset", None)  # read by then, where the command takes one
    return {**(preset.values if preset else {}), **optional_settings(options)}


def optional_settings(options: argparse.Namespace) -> dict[str, Any]:
    """Those given as options."""
    return {
        path: parse(f"--{path}", text, leaf)
        for path, leaf, _ in walk(Settings())
        if (text := getattr(options, path, None)) is not None
    }


def view(options: argparse.Namespace) -> int:
    """Open the window."""
    from .files import check_folder
    from .window import open_window

    check_folder(f"{options.screenshots}/picture.png", "--screenshots")
    settings = Settings()
    given = given_settings(options)
    return open_window(options.scene, options.view, options.size, settings, options.viewpoint, given, options)


def shot(options: argparse.Namespace) -> int:
    """Render one picture."""
    from .files import check_folder
    from .frame.pipeline import CONVERGING, LENS_RAYS, check_view
    from .gpu.context import device_name, headless_context
    from .picture import check_path, write_exr, write_json, write_png
    from .renderer import Renderer
    from .scene.load import scene_file
    from .session import load_gpu_scene

    output = check_path(options.output)
    if options.report:
        check_folder(options.report, "--report")
    given = given_settings(options)
    check_view(options.view)
    scene_file(options.scene)
    ctx = headless_context()
    scene, gpu_scene = load_gpu_scene(ctx, options.scene, show_progress)
    viewpoint, settings = start_of(options, scene, (gpu_scene.facts.low, gpu_scene.facts.high), given)
    renderer = Renderer(ctx, gpu_scene, options.size, seed=options.seed, share_memory=True)
    renderer.progress_callback = show_progress
    renderer.profiler.enabled = bool(options.report)
    begin = time.perf_counter()
    frames = (
        _batches(options.spp, TRACE_BATCH if options.view in LENS_RAYS else 1)
        if options.view in CONVERGING
        else [1] * options.frames
    )
    frame_ms = []
    for done, samples in enumerate(frames):
        if options.report and done == len(frames) - 1:
            renderer.health.watched = "all"
        started = time.perf_counter()
        before_s = (len(frames) - 1 - done) / options.fps if options.fps and options.view not in CONVERGING else 0.0
        renderer.draw(options.view, viewpoint.camera, _with_samples(settings, samples), time_s=options.time - before_s)
        ctx.finish()
        frame_ms.append((time.perf_counter() - started) * 1e3)
        show_progress(f"{options.view}", (done + 1) / len(frames))
    seconds = time.perf_counter() - begin
    facts = {
        "scene": options.scene,
        "view": options.view,
        "size": list(options.size),
        "seed": options.seed,
        "time": options.time,
        "fps": options.fps,
        "samples": renderer.converged_samples,
        "camera": camera_values(viewpoint.camera),
        "settings": to_dict(settings),
        "version": version(),
    }
    if output.suffix.lower() == ".exr":
        write_exr(output, renderer.linear(), facts)
    else:
        write_png(output, renderer.picture(), facts)
    if options.report:
        renderer.profiler.flush()
        times = {
            "device": device_name(ctx),
            "timing_source": renderer.profiler.source,
            "seconds": seconds,
            "frame_ms": frame_ms,
            "pass_ms": dict(renderer.timings),
            "bytes": renderer.memory,
            "bad_texels": {name: asdict(bad) for name, bad in renderer.health.finish().items()},
            "passes": _listed(renderer.plan),
        }
        write_json(options.report, {**facts, **times})
    return 0


def bench(options: argparse.Namespace) -> int:
    """Accuracy against time, or two such results compared."""
    from .bench_command import run

    return run(options, given_settings(options), version())


def doctor(options: argparse.Namespace) -> int:
    """Driver, limits and the timer's self-test."""
    from .frame.memory import mib
    from .gpu.context import device_name, headless_context, is_software
    from .gpu.timing import self_test

    ctx = headless_context()
    source, query_ms, clock_ms = self_test(ctx)
    print(f"hybrid-dof {version()}, Python {sys.version.split()[0]}")
    for package in ("moderngl", "moderngl-window", "imgui-bundle", "pyrr", "trimesh", "numpy"):
        print(f"  {package} {metadata.version(package)}")
    print(f"device: {device_name(ctx)}")
    software = "a software rasteriser: its milliseconds say nothing about GPUs"
    print(f"  vendor: {ctx.info['GL_VENDOR']}; {software if is_software(ctx) else 'hardware'}")
    limits = {
        "storage block": mib(ctx.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"]),
        "texture side": f"{ctx.info['GL_MAX_TEXTURE_SIZE']} px",
        "array layers": ctx.info["GL_MAX_ARRAY_TEXTURE_LAYERS"],
        "vertex storage blocks": f"{ctx.info['GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS']} (moving objects need 1)",
        "work group": f"{ctx.info['GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS']} invocations",
        "colour attachments": ctx.info["GL_MAX_COLOR_ATTACHMENTS"],
    }
    for name, value in limits.items():
        print(f"  {name}: {value}")
    print(f"timer: {source} (a known load: query {query_ms:.3f} ms, wall clock {clock_ms:.3f} ms)")
    return 0


def scenes(options: argparse.Namespace) -> int:
    """List the built-in scenes, and those that strain the arithmetic."""
    from .scene.gallery import SCENES
    from .scene.stress.catalogue import STRESS

    for entry in SCENES:
        print(f"{entry.name:<22}{entry.description}")
    print("\nstress scenes, each made to be hard for what it names:")
    for stress in STRESS:
        print(f"{stress.name:<22}{stress.description}")
    return 0


def start_of(options: argparse.Namespace, scene: Any, bounds: Any, given: dict[str, Any]) -> tuple[Viewpoint, Settings]:
    """From where a picture is taken, and with which settings."""
    from .session import focused, viewpoints

    view = options.viewpoint or viewpoints(scene, bounds)[0]
    return view, focused(Settings(), view, given)


def _batches(total: int, batch: int) -> list[int]:
    return [batch] * (total // batch) + [total % batch] * (total % batch > 0)


def _with_samples(settings: Settings, samples: int) -> Settings:
    return put(settings, "rays.samples_per_frame", samples)  # type: ignore[no-any-return]


def _listed(frame: Any) -> dict[str, str]:
    return {
        **{c.step.name: f"runs: {c.reason}" for c in frame.calls},
        **{s.name: f"skipped: {s.reason}" for s in frame.skipped},
    }


def show_progress(text: str, fraction: float) -> None:
    """One line on a terminal, rewritten in place; nothing where stderr is no terminal."""
    if sys.stderr.isatty():
        end = "\n" if fraction >= 1.0 else ""
        print(f"\r\x1b[K{text} {100 * fraction:3.0f} %", end=end, file=sys.stderr, flush=True)
