"""What a survey is of, and which of its figures stay valid when something changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from ..camera import Camera
from ..settings import Overlay, Settings, put, walk
from .candidates import Candidate

Key = tuple[Any, ...]

# What candidates vary. While nothing else changes they stay what they were, so that trying one does not move the rest.
VARIED = ("post.rings", "rays.budget", "rays.max_per_pixel", "rays.samples_per_frame")
# The settings that decide a view's picture and time, by the beginnings of their names; lens and shading always do.
READ = {
    "sharp": ("temporal.",),
    "post": ("temporal.", "post."),
    "hybrid": (
        "temporal.",
        "post.",
        "mask.",
        "rays.budget",
        "rays.max_per_pixel",
        "rays.focus_blend",
        "rays.history",
        "reconstruct.",
        "blend.",
    ),
    "traced": ("rays.samples_per_frame",),
    "reference": (),
}


@dataclass(frozen=True)
class Subject:
    """The picture on screen, as far as a survey depends on it."""

    scene: object
    edition: int  # of scene and shaders: another one is another picture
    camera: Camera
    time_s: float
    view: str
    settings: Settings
    size: tuple[int, int]  # px, of the survey
    dear: bool = False  # whether the dearest candidates are wanted
    flip: bool = False  # whether FLIP is, too: it takes longer than a small frame

    @property
    def truth_key(self) -> Key:
        """Equal for two subjects exactly if they have the same reference."""
        return self.scene, self.edition, self.camera, self.time_s, self.size, truth_values(self.settings)


def survey_size(size: tuple[int, int], width: int) -> tuple[int, int]:
    """As large a picture of the same shape as has `width` by 9/16 of that in pixels, but no larger than `size`."""
    scale = min(1.0, width * math.sqrt(9 / 16) / math.sqrt(size[0] * size[1]))
    return max(round(size[0] * scale), 1), max(round(size[1] * scale), 1)


def truth_values(settings: Settings) -> Key:
    """Of the settings, those that a reference depends on."""
    return _values(settings, ("lens.", "shading."))


def plainly(settings: Settings) -> Settings:
    """Without what is only painted over the picture, which must not be timed."""
    return replace(settings, overlay=Overlay())


def applied(candidate: Candidate, settings: Settings) -> Settings:
    """`settings` with what the candidate varies."""
    for path, _, value in walk(candidate.settings):
        if path in VARIED:
            settings = put(settings, path, value)
    return settings


def key_of(candidate: Candidate) -> Key:
    """Equal for two candidates exactly if they draw the same, with the same effort."""
    return candidate.view, _values(candidate.settings, READ[candidate.view])


def _values(settings: Settings, beginnings: tuple[str, ...]) -> Key:
    kept = ((path, leaf, value) for path, leaf, value in walk(settings) if path.startswith(beginnings))
    return tuple((path, value) for path, leaf, value in kept if leaf.metadata["resets"] or path in VARIED)


def unvaried(settings: Settings) -> Key:
    return tuple((path, v) for path, leaf, v in walk(settings) if path not in VARIED and leaf.metadata["resets"])
