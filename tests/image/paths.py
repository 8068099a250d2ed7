"""Scripted motion: where the camera is, and what time it is, in each frame."""

from __future__ import annotations

import math

from app.camera import Camera, Moment

from .stage import Stage
from .subjects import Subject

LAP = 32  # frames until a flying camera is back: it keeps what blurs in front of it in view, and every tenth frame
# finds it at another place, never at rest
STEP = 0.01  # of the focus distance, its longest way in one frame: 2 cm at 2 m, a slow walk
TURN = math.radians(2.0)  # how far it looks away to either side
FPS = 25.0  # frames per second of the scene's own motion


def moments(subject: Subject, stage: Stage, frames: int) -> list[Moment]:
    """The subject's motion."""
    if subject.moves == "objects":
        return [Moment(stage.camera, k / FPS) for k in range(frames)]
    return [Moment(flown(stage.camera, stage.settings.lens.focus_distance, k), 0.0) for k in range(frames)]


def flown(camera: Camera, focus_m: float, k: int) -> Camera:
    """The camera in frame k of a swing to its right and left, fastest in the first frame, with its gaze a quarter of a
    lap behind: each frame turns and moves, and none does it as the last one did.
    """
    phase = 2.0 * math.pi * k / LAP
    right = STEP * focus_m * LAP / (2.0 * math.pi) * math.sin(phase)
    return camera.moved(right, 0.0, 0.0).turned(TURN * (1.0 - math.cos(phase)) / 2.0, 0.0)


def checked(frames: int, every: int) -> list[int]:
    """Frames at which a motion is judged: the last of each `every`, or the very last where there are fewer."""
    return list(range(every - 1, frames, every)) or [frames - 1]
