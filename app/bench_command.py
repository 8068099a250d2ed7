"""`hybrid-dof bench`: scenes times candidates, measured one after the other, kept at once, and reported."""

from __future__ import annotations

import argparse
import hashlib
import platform
import shlex
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from .bench_options import Subject, effort_of, folder_of, subjects_of
from .camera import read_viewpoint
from .errors import UserError
from .measure.bench import Effort, Stage, measured, scene_values, slug, traced_series
from .measure.bench_progress import REFERENCE, SERIES, Bar, duration, guessed_s
from .measure.bench_store import FORMAT, Store, read_results
from .measure.candidates import Candidate
from .scene.load import scene_file
from .settings import Settings, plain

PACKAGES = ("moderngl", "numpy", "trimesh", "pillow", "flip-evaluator", "matplotlib")


def run(options: argparse.Namespace, given: Mapping[str, Any], version: str) -> int:
    """The command. `given`: the settings that were options."""
    if options.compare:
        return _compare(options)
    if not options.output:
        raise UserError("bench needs a folder to write: -o DIR (see hybrid-dof bench --help)")
    effort, subjects = effort_of(options), subjects_of(options.scenes)
    store = Store(folder_of(options.output))

    from .gpu.context import device_name, headless_context
    from .measure.bench_report import write_report
    from .measure.metrics import has_flip
    from .measure.plots import write_plots

    ctx = headless_context()
    flip = has_flip()
    configuration = {
        "program": f"{version} ({_program_digest()})",
        "device": device_name(ctx),
        "effort": asdict(effort),
        "settings": {path: plain(value) for path, value in given.items()},
        "scenes": {s.name: [s.scene, s.camera_file, *_digests(s)] for s in subjects},
        "flip": flip,
    }
    store.begin(configuration, fresh=options.fresh)
    if not flip:
        _say("FLIP is left out: it needs flip-evaluator (pip install 'hybrid-dof[metrics]')")
    about = {
        "format": FORMAT,
        "command": shlex.join(["hybrid-dof", *options.arguments]),
        "device": device_name(ctx),
        "driver": {name: ctx.info[f"GL_{name.upper()}"] for name in ("vendor", "renderer", "version")},
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {"hybrid-dof": version, **{name: _version(name) for name in PACKAGES}},
        **asdict(effort),
        "given_settings": configuration["settings"],
    }
    results, files = about, []
    for results in _Runs(ctx, effort, given, store, subjects, about).after_each_scene():
        files = write_report(results, store.folder)  # so that a later interruption leaves something to read
    try:
        files += write_plots(results, store.folder)
    except UserError as error:
        _say(str(error))
    print(*files, sep="\n")
    return 0


class _Runs:
    """All parts in order; those that the store holds are not run again."""

    def __init__(
        self,
        ctx: Any,
        effort: Effort,
        given: Mapping[str, Any],
        store: Store,
        subjects: list[Subject],
        about: dict[str, Any],
    ) -> None:
        self._ctx, self._effort, self._given, self._store = ctx, effort, given, store
        self._subjects, self._about = subjects, about
        self._labels = [(c.label, c) for c in effort.chosen(Settings())]
        ahead = [guessed_s(part, effort) for subject in subjects for part in self._missing(subject)]
        self._bar = Bar(ahead, sys.stderr)
        kept = sum(self._kept(s, label) is not None for s in subjects for label, _ in self._labels)
        runs = len(subjects) * len(self._labels)
        _say(
            f"{len(subjects)} scene{'s' * (len(subjects) > 1)}, {runs} runs"
            + (f", {kept} of them done before" if kept else "")
            + (f"; a first guess: {duration(sum(ahead))}" if ahead else "")
        )

    def after_each_scene(self) -> Iterator[dict[str, Any]]:
        """Run what is missing; all results so far, each time that a scene is done."""
        try:
            for subject in self._subjects:
                if missing := self._missing(subject):
                    self._scene(subject, missing)
                yield {**self._about, "scenes": [self._results(s) for s in self._subjects if not self._missing(s)]}
        except KeyboardInterrupt:
            self._bar.close()
            _say("what is done is kept; the same command goes on from there")
            raise
        finally:
            self._bar.close()

    def _results(self, subject: Subject) -> dict[str, Any]:
        named = {"name": subject.name, "scene": subject.scene, "camera_file": subject.camera_file}
        runs = [self._kept(subject, label) for label, _ in self._labels]
        return {**named, **self._kept(subject, "scene"), "runs": runs}

    def _kept(self, subject: Subject, label: str) -> Any:
        return self._store.get(slug(subject.name), slug(label))

    def _missing(self, subject: Subject) -> list[str | Candidate]:
        candidates = [c for label, c in self._labels if self._kept(subject, label) is None]
        shared = [REFERENCE] if candidates or self._kept(subject, "scene") is None else []
        if any(c.view == "traced" for c in candidates) and self._kept(subject, SERIES) is None:
            return [*shared, SERIES, *candidates]
        return [*shared, *candidates]

    def _scene(self, subject: Subject, missing: list[str | Candidate]) -> None:
        effort, bar, where = self._effort, self._bar, slug(subject.name)
        bar.begin(f"{subject.name}, {REFERENCE}", guessed_s(REFERENCE, effort))
        stage, values = self._opened(subject)
        self._store.put(where, "scene", values)
        bar.end()
        of_label = {c.label: c for c in effort.chosen(stage.settings)}  # with the scene's own lens
        for part in missing[1:]:
            label = part if isinstance(part, str) else part.label
            bar.begin(f"{subject.name}, {label}", guessed_s(part, effort))
            if isinstance(part, str):
                done = traced_series(stage, effort, bar.show)
            else:
                series = self._kept(subject, SERIES) if part.view == "traced" else None
                done = measured(stage, of_label[label], effort, series)
            self._store.put(where, slug(label), done)
            bar.end()
        scene = stage.renderer.scene
        stage.renderer.release()
        scene.release()

    def _opened(self, subject: Subject) -> tuple[Stage, dict[str, Any]]:
        from .measure.reference import reference
        from .measure.store import scene_digest
        from .renderer import Renderer
        from .session import focused, load_gpu_scene, viewpoints

        scene, gpu = load_gpu_scene(self._ctx, subject.scene, self._bar.show)
        low, high = np.array(gpu.facts.low), np.array(gpu.facts.high)
        own = viewpoints(scene, (low, high))[0]
        viewpoint = read_viewpoint(subject.camera_file) if subject.camera_file else own
        settings = focused(Settings(), viewpoint, self._given)
        renderer = Renderer(self._ctx, gpu, self._effort.size, seed=self._effort.seed, share_memory=True)
        digest = scene_digest(scene)
        truth = reference(
            self._ctx,
            renderer,
            viewpoint.camera,
            settings,
            self._effort.spp,
            scene=digest,
            time_s=self._effort.time_s,
            progress=self._bar.show,
        )
        stage = Stage(self._ctx, renderer, viewpoint.camera, settings, truth)
        return stage, scene_values(stage, self._effort, digest)


def _compare(options: argparse.Namespace) -> int:
    from .measure.compare import compared

    if options.scenes or options.output:
        raise UserError("--compare takes two results and nothing else; leave out scenes and -o")
    print(compared(*(read_results(Path(path)) for path in options.compare)))
    return 0


def _digests(subject: Subject) -> list[str]:
    """Of the files that a subject is made of: a changed one is another subject."""
    paths = [scene_file(subject.scene), *([Path(subject.camera_file)] if subject.camera_file else [])]
    try:
        return [hashlib.sha256(path.read_bytes()).hexdigest()[:16] for path in paths]
    except OSError as error:
        raise UserError(f"{subject.name}: {error.filename}: {error.strerror or error}") from None


def _program_digest() -> str:
    """Of all that is ours and draws: an edited checkout is another program."""
    from .gpu.shaders import load_glsl

    package = Path(__file__).parent
    sources = [path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))]
    return hashlib.sha256("\0".join([*sources, *load_glsl().values()]).encode()).hexdigest()[:16]


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _say(sentence: str) -> None:
    print(f"hybrid-dof bench: {sentence}", file=sys.stderr, flush=True)
