"""The views that are measured: built-in scenes, and real ones where they lie beside the checkout."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import moderngl

from app.scene.gallery import find

from .. import conftest
from . import comparison
from .comparison import Box
from .stage import Stage, opened

BOXED_AT = (640, 360)  # px: the size for which details are given


@dataclass(frozen=True)
class Subject:
    """One scene seen by one camera, what moves when it is measured in motion, and where to look closely."""

    name: str
    scene: str  # built-in, or a file among the shared scenes
    detail: Box  # a blurred silhouette, px at BOXED_AT
    camera: str | None = None  # a file among the shared scenes; None: the scene's own first camera
    unlit: bool = False  # base colour on a background of 0.5, 0.6, 0.7
    moves: Literal["camera", "objects"] | None = None

    @property
    def shared(self) -> bool:
        """Whether the scene is not ours, and may be missing."""
        return find(self.scene) is None

    @property
    def file(self) -> Path:
        """Where the scene lies."""
        own = find(self.scene)
        return own.path if own else conftest.SHARED_SCENES / self.scene

    def opened(self, ctx: moderngl.Context) -> Stage:
        """The scene from this camera. Subjects of one scene share a renderer."""
        camera_file = conftest.SHARED_SCENES / self.camera if self.camera else None
        return opened(ctx, str(self.file) if self.shared else self.scene, camera_file, self.unlit)

    def digest(self) -> str:
        """What tells this scene from every other: a hash of its file (GLB: all is in it)."""
        return hashlib.sha256(self.file.read_bytes()).hexdigest()

    def detail_px(self, size: tuple[int, int]) -> Box:
        """The detail at another size of the picture, at least a pixel wide and high."""
        x, y = (size[i] / BOXED_AT[i] for i in (0, 1))
        left, top, right, bottom = self.detail
        left, top = int(left * x), int(top * y)
        return left, top, max(round(right * x), left + 1), max(round(bottom * y), top + 1)


ROOM, LIVING = "greywhite_room.glb", "modern_living_room_partial.glb"

SUBJECTS = (
    Subject("room", ROOM, (430, 170, 570, 310), "greywhite_room.json", unlit=True),
    Subject("plant", ROOM, (60, 100, 200, 240), "greywhite_room_plant.json", unlit=True, moves="camera"),
    Subject("living", LIVING, (60, 200, 200, 340), "modern_living_room_partial.json", unlit=True),
    Subject("still-life", "still-life", comparison.DETAIL, moves="camera"),
    Subject("toy-train", "toy-train", comparison.TRAIN, moves="objects"),
)
IN_MOTION = tuple(subject for subject in SUBJECTS if subject.moves)


def present(subjects: Sequence[Subject]) -> list[Subject]:
    """Those that can be opened here."""
    return [subject for subject in subjects if not subject.shared or subject.file.exists()]


def left_out(subjects: Sequence[Subject]) -> str:
    """A sentence that names the others; empty if there are none."""
    here = present(subjects)
    names = ", ".join(subject.name for subject in subjects if subject not in here)
    return f"Left out: {names}, whose scenes are not beside this checkout (they are not ours to ship)." * bool(names)
