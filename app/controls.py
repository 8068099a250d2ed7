"""What keys and the mouse do: one table, and the fly camera as a pure function of what is held. No window, no GL.

Key names are pyglet's, in lower case ("w", "_1", "f12", "lshift").
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from .camera import Camera

# The simulation's step, whatever a frame takes: the same keys held for the same time fly the same way.
STEP_S = 1.0 / 60.0
MAX_STEPS = 60  # of one frame: after a stall (loading, a compile) the camera makes up one second, not the whole pause
FAST, SLOW = 4.0, 0.25  # Shift and Ctrl; two octaves either way cross a hall or inspect a leaf
WHEEL_FACTOR = 1.2  # speed per wheel notch: four notches double it
SPEED_RANGE = (1e-3, 1e5)  # m/s
LOOK_RAD_PER_PX = math.radians(0.15)  # 600 px turn a quarter circle, the common default of first-person views


@dataclass(frozen=True)
class Binding:
    """One row of the key table, and of the help that is made from it."""

    keys: tuple[str, ...]  # any of them; empty for a mouse gesture
    action: str
    group: str
    meaning: str
    gesture: str = ""  # how a person calls it, where the key's name would not do

    @property
    def label(self) -> str:
        """What the help shows: "W", "F12", "Right drag"."""
        return self.gesture or " or ".join(key.strip("_").upper() for key in self.keys)


BINDINGS = (
    Binding(("w",), "forward", "Fly", "forward"),
    Binding(("s",), "back", "Fly", "back"),
    Binding(("a",), "left", "Fly", "left"),
    Binding(("d",), "right", "Fly", "right"),
    Binding(("e",), "up", "Fly", "up"),
    Binding(("q",), "down", "Fly", "down"),
    Binding(("lshift", "rshift"), "fast", "Fly", f"{FAST:g} times as fast", "Shift"),
    Binding(("lctrl", "rctrl"), "slow", "Fly", f"{SLOW:g} times as fast", "Ctrl"),
    Binding((), "speed", "Fly", "change the speed", "Wheel"),
    Binding((), "look", "Fly", "look around while held", "Right drag"),
    Binding(("tab",), "toggle_look", "Fly", "look around with the mouse, until pressed again", "Tab"),
    Binding(("_0",), "view sharp", "View", "sharp: a pinhole, no depth of field"),
    Binding(("_1",), "view post", "View", "post-process"),
    Binding(("_2",), "view hybrid", "View", "hybrid"),
    Binding(("_3",), "view traced", "View", "ray-traced"),
    Binding(("_4",), "view reference", "View", "raster reference"),
    Binding(("c",), "compare", "View", "split screen on or off; drag the bar"),
    Binding(("h",), "heat", "View", "where the picture is wrong, and how much"),
    Binding(("m",), "survey", "View", "measure what accuracy costs: a section of the panel"),
    Binding(("p",), "pause", "View", "stop or go on with the scene's motion"),
    Binding((), "focus", "View", "focus on what is under the pointer", "Click"),
    Binding(("f1",), "help", "Window", "this help"),
    Binding(("f2",), "hide_ui", "Window", "hide or show the panel"),
    Binding(("f5",), "reload", "Window", "reload the shaders"),
    Binding(("f12",), "screenshot", "Window", "save a picture with its settings"),
    Binding(("escape",), "quit", "Window", "quit", "Esc"),
)

ACTIONS = {key: binding.action for binding in BINDINGS for key in binding.keys}

# action -> direction along (right, up, forward)
_MOVES = {
    "forward": (0, 0, 1),
    "back": (0, 0, -1),
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "up": (0, 1, 0),
    "down": (0, -1, 0),
}


def fly(camera: Camera, held_keys: Iterable[str], mouse_delta: tuple[float, float], speed: float, dt: float) -> Camera:
    """The camera after `dt` seconds with `held_keys` down, turned by `mouse_delta` [px, y downwards]; `speed` in m/s.

    Turns first, then moves, so that one step flies where the picture points. Diagonals are no faster.
    """
    if mouse_delta != (0.0, 0.0):
        camera = camera.turned(-mouse_delta[0] * LOOK_RAD_PER_PX, -mouse_delta[1] * LOOK_RAD_PER_PX)
    held = {ACTIONS[key] for key in held_keys if key in ACTIONS}
    direction = np.sum([_MOVES[action] for action in held & _MOVES.keys()] or [(0, 0, 0)], axis=0)
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        return camera
    pace = speed * dt / length * (FAST if "fast" in held else 1.0) * (SLOW if "slow" in held else 1.0)
    return camera.moved(*(float(pace * x) for x in direction))


def flying(held_keys: Iterable[str]) -> bool:
    """Whether any held key moves the camera."""
    return any(ACTIONS.get(key) in _MOVES for key in held_keys)


def wheel_speed(speed: float, notches: float) -> float:
    """The fly speed [m/s] after `notches` of the wheel."""
    return min(max(speed * WHEEL_FACTOR**notches, SPEED_RANGE[0]), SPEED_RANGE[1])


@dataclass
class Pilot:
    """Collects input between frames and spends it in fixed steps."""

    speed: float = 1.0  # m/s
    held: set[str] = field(default_factory=set)
    _tapped: set[str] = field(
        default_factory=set
    )  # pressed since the last step: a tap shorter than a slow frame still counts
    _turn: tuple[float, float] = (0.0, 0.0)  # px
    _debt: float = 0.0  # s not yet simulated

    def press(self, key: str) -> None:
        self.held.add(key)
        self._tapped.add(key)

    def release(self, key: str) -> None:
        self.held.discard(key)

    def look(self, dx: float, dy: float) -> None:
        self._turn = (self._turn[0] + dx, self._turn[1] + dy)

    def let_go(self) -> None:
        """Forget everything held: the window lost the keyboard, and the releases will go elsewhere."""
        self.held.clear()
        self._tapped.clear()

    @property
    def active(self) -> bool:
        """Whether the next steps would move or turn the camera."""
        return flying(self.held | self._tapped) or self._turn != (0.0, 0.0)

    def advance(self, camera: Camera, elapsed: float) -> Camera:
        """Fly on by `elapsed` seconds, in whole steps; what is left over is flown next time."""
        if not self.active:
            self._debt = 0.0
            self._tapped.clear()
            return camera
        self._debt += elapsed
        steps = min(int(self._debt / STEP_S + 1e-9), MAX_STEPS)
        self._debt = min(self._debt - steps * STEP_S, STEP_S)
        for _ in range(steps):
            camera = fly(camera, self.held | self._tapped, self._turn, self.speed, STEP_S)
            self._tapped.clear()
            self._turn = (0.0, 0.0)
        return camera
