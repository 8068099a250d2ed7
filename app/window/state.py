"""What the window knows between two frames, shared by its event handler, its request handler and its loop."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..camera import Camera
from ..controls import Pilot
from ..panel.model import Look, Request, Shown

MESSAGE_S = 5.0  # a message's life: time to read a path
LONGEST_STEP_S = 1.0  # by which one frame may advance a scene's motion
AWAKE_S = 0.7  # the panel is drawn on for this long after the last event: tooltips wait for a pointer that rests


@dataclass
class State:
    """Changed between frames only, all on one thread."""

    look: Look
    shown: Shown
    given: Mapping[str, Any] = field(
        default_factory=dict
    )  # settings chosen as options: they win over the first viewpoint's
    camera: Camera = field(default_factory=Camera)
    pilot: Pilot = field(default_factory=Pilot)
    playing: bool = True  # a scene's motion goes on
    time_s: float = 0.0  # of that motion
    requests: list[Request] = field(default_factory=list)
    awake_until: float = 0.0  # s, of time.perf_counter, like the next two
    last_input: float = 0.0
    message_until: float = 0.0

    def say(self, message: str) -> None:
        """Show a sentence for a few seconds."""
        self.shown = replace(self.shown, message=message)
        self.message_until = time.perf_counter() + MESSAGE_S
        self.awake_until = max(self.awake_until, time.perf_counter() + AWAKE_S)

    def touched(self) -> None:
        """An event arrived."""
        self.last_input = time.perf_counter()
        self.awake_until = max(self.awake_until, self.last_input + AWAKE_S)

    def take_requests(self) -> list[Request]:
        """Everything asked for since the last call."""
        taken, self.requests = self.requests, []
        return taken

    def pass_time(self, seconds: float) -> None:
        """Let the scene's motion go on, unless it is paused. A stall (loading, a compile) makes it wait, not jump."""
        if self.playing:
            self.time_s += min(seconds, LONGEST_STEP_S)

    def log_entry(self) -> dict[str, Any]:
        """The state as the status log holds it; the loop adds what it knows."""
        look, lens = self.look, self.look.settings.lens
        return {
            "view": look.view,
            "other": look.other if look.compare else None,
            "bar": look.bar,
            "panel": look.panel,
            "help": look.help,
            "focus_distance": lens.focus_distance,
            "aperture": lens.aperture,
            "eye": list(self.camera.eye),
            "forward": list(self.camera.forward),
            "speed": self.pilot.speed,
            "playing": self.playing,
            "time_s": round(self.time_s, 1),
            "message": self.shown.message,
            "load_error": self.shown.load_error,
            "preset_error": self.shown.preset_error,
            "advising": self.shown.advising,
            "shader_error": self.shown.shader_error,
        }
