"""What `hybrid-dof bench` is asked to do: its options, checked before any time is spent."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .camera import read_viewpoint
from .errors import UserError
from .files import check_folder
from .measure.bench import VIEWS, Effort, slug, subject_name
from .scene.gallery import SCENES
from .scene.load import scene_file
from .settings import Settings, parse, walk

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


def folder_of(text: str) -> Path:
    folder = Path(text)
    check_folder(folder, "-o")
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
