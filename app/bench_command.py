"""`hybrid-dof bench`: scenes times candidates, measured one after the other, kept at once, and reported."""

from __future__ import annotations

import argparse
import hashlib
import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from .camera import read_viewpoint
from .errors import UserError
from .measure.bench import VIEWS, Effort, Stage, measured, scene_values, slug, subject_name, traced_series
from .measure.bench_progress import REFERENCE, SERIES, Bar, duration, guessed_s
from .measure.bench_store import FORMAT, Store, read_results
from .measure.candidates import Candidate
from .settings import Settings, parse, plain, walk

PACKAGES = ("moderngl", "numpy", "trimesh", "pillow", "flip-evaluator", "matplotlib")
NUMBERS = ("frames", "timed", "spp")
LISTS = {
    "rings": "post.rings",
    "rays": "rays.budget",
    "samples": "rays.samples_per_frame",
}  # options that vary a setting
QUICK: dict[str, Any] = {"frames": 4, "timed": 6, "spp": 64, "rings": (4,), "rays": (1.0, 4.0), "samples": (1, 4, 16)}


@dataclass(frozen=True)
class Subject:
    """A scene, and the camera file it is seen by; None: its own first camera."""

    name: str
    scene: str
    camera_file: str | None


def run(options: argparse.Namespace, given: Mapping[str, Any], version: str) -> int:
    """The command. `given`: the settings that were options."""
    if options.compare:
        return _compare(options)
    if not options.output:
        raise UserError("bench needs a folder to write: -o DIR (see hybrid-dof bench --help)")
    effort, subjects = effort_of(options), subjects_of(options.scenes)
    store = Store(_folder(options.output))

    from .gpu.context import device_name, headless_context
    from .measure.metrics import has_flip

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
    results = _Runs(ctx, effort, given, store, subjects, about).all()
    for line in _written(results, store.folder):
        print(line)
    return 0


def effort_of(options: argparse.Namespace) -> Effort:
    """How much is run: `--quick` changes what was not given. Raises UserError."""
    numbers = {name: value for name in NUMBERS if (value := getattr(options, name)) is not None}
    lists = {name: _listed(name, text) for name in LISTS if (text := getattr(options, name)) is not None}
    effort = Effort(
        size=options.size,
        seed=options.seed,
        time_s=options.time,
        views=_views(options.views),
        **{**(QUICK if options.quick else {}), **numbers, **lists},
    )
    if effort.spp % 2:
        raise UserError(f"--spp {effort.spp}: give an even number, since a reference is drawn in two halves")
    return effort


def subjects_of(given: list[str]) -> list[Subject]:
    """Scenes as they were named, SCENE or SCENE@CAMERA.json; all built-in ones where none was. Raises UserError."""
    from .scene.gallery import SCENES
    from .scene.load import scene_file

    subjects: list[Subject] = []
    for text in given or [entry.name for entry in SCENES]:
        scene, at, camera = text.rpartition("@")
        if not at or not camera.endswith(".json"):
            scene, camera = text, ""
        scene_file(scene)
        if camera:
            read_viewpoint(camera)
        if any((s.scene, s.camera_file) == (scene, camera or None) for s in subjects):
            raise UserError(f"{text} is named twice")
        name = first = subject_name(scene, camera or None)
        count = 1
        while any(slug(s.name) == slug(name) for s in subjects):
            count += 1
            name = f"{first} ({count})"
        subjects.append(Subject(name, scene, camera or None))
    return subjects


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

    def all(self) -> dict[str, Any]:
        """Run what is missing; everything that is known then."""
        try:
            for subject in self._subjects:
                if missing := self._missing(subject):
                    self._scene(subject, missing)
        except KeyboardInterrupt:
            self._bar.close()
            _say("what is done is kept; the same command goes on from there")
            raise
        finally:
            self._bar.close()
        scenes = []
        for subject in self._subjects:
            runs = [self._kept(subject, label) for label, _ in self._labels]
            scenes.append(
                {
                    "name": subject.name,
                    "scene": subject.scene,
                    "camera_file": subject.camera_file,
                    **self._kept(subject, "scene"),
                    "runs": runs,
                }
            )
        return {**self._about, "scenes": scenes}

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
        own = viewpoints(scene, (gpu.facts.low, gpu.facts.high))[0]
        viewpoint = read_viewpoint(subject.camera_file) if subject.camera_file else own
        settings = focused(Settings(), viewpoint, self._given)
        renderer = Renderer(self._ctx, gpu, self._effort.size, seed=self._effort.seed)
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


def _written(results: dict[str, Any], folder: Path) -> list[str]:
    """The files that were made of the results, and what was not."""
    from .measure.bench_report import write_report
    from .measure.plots import write_plots

    files = write_report(results, folder)
    try:
        files += write_plots(results, folder)
        notes = []
    except UserError as error:
        notes = [str(error)]
    return [*map(str, files), *notes]


def _compare(options: argparse.Namespace) -> int:
    from .measure.compare import compared

    if options.scenes or options.output:
        raise UserError("--compare takes two results and nothing else; leave out scenes and -o")
    print(compared(*(read_results(Path(path)) for path in options.compare)))
    return 0


def _folder(text: str) -> Path:
    folder = Path(text)
    if not folder.absolute().parent.is_dir():
        raise UserError(f"-o {text}: there is no folder {folder.parent}")
    if folder.exists() and not folder.is_dir():
        raise UserError(f"-o {text} is a file; name a folder")
    return folder


def _views(text: str | None) -> tuple[str, ...]:
    if text is None:
        return VIEWS
    named = text.split(",")
    if unknown := [name for name in named if name not in VIEWS]:
        raise UserError(f"--views: there is no {unknown[0]!r} to compare; choose from {','.join(VIEWS)}")
    return tuple(view for view in VIEWS if view in named)


def _listed(name: str, text: str) -> tuple[Any, ...]:
    """Values of a setting separated by commas, in order, each once."""
    leaf = next(leaf for path, leaf, _ in walk(Settings()) if path == LISTS[name])
    try:
        return tuple(sorted({parse(LISTS[name], part, leaf) for part in text.split(",")}))
    except UserError as error:
        raise UserError(f"--{name} {text!r}: {str(error).split(': ', 1)[-1]}, or several with commas between") from None


def _digests(subject: Subject) -> list[str]:
    """Of the files that a subject is made of: a changed one is another subject."""
    from .scene.load import scene_file

    paths = [scene_file(subject.scene), *([Path(subject.camera_file)] if subject.camera_file else [])]
    return [hashlib.sha256(path.read_bytes()).hexdigest()[:16] for path in paths]


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
