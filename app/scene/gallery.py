"""The built-in scenes, all made by ourselves with the scripts in assets/."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..data import data_dir


@dataclass(frozen=True)
class BuiltIn:
    """One built-in scene; its camera, focus distance and aperture are stored in the file."""

    name: str
    description: str
    file: str  # in assets/

    @property
    def path(self) -> Path:
        return data_dir("assets") / self.file


SCENES = (
    BuiltIn(
        "still-life",
        "A vase and chess pieces on a table, seen past a leafy branch, with a string of lights behind",
        "still_life.glb",
    ),
    BuiltIn(
        "toy-train",
        "A toy train crosses a painted town, seen between the sails of turning wind wheels, with bulbs far behind",
        "toy_train.glb",
    ),
)
DEFAULT = SCENES[0]


def find(name: str) -> BuiltIn | None:
    """The built-in scene of that name, or None."""
    return next((scene for scene in SCENES if scene.name == name), None)
