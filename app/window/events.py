"""Keys and mouse, ImGui first: what it does not want moves the camera, the focus, the bar, or becomes a request."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from ..controls import ACTIONS, wheel_speed
from ..panel.input import UiInput
from ..panel.model import Request, Wish
from ..panel.panel import Panel
from ..presets import SUFFIX
from ..session import in_lens_range
from ..settings import put
from .desktop import Desktop
from .stage import Stage
from .state import State

CLICK_SLOP = 4.0  # window units a click may wander before it is a drag
BAR_GRAB = 6.0  # window units on either side of the bar that take hold of it


class Events:
    """Implements desktop.Listener. Positions are window units from the top left."""

    def __init__(self, desktop: Desktop, state: State, stage: Stage, panel: Panel, digest: Callable[[], None]) -> None:
        """`digest` lets ImGui work through what it was given: else its word on the next event is a slow frame old."""
        self._desktop, self._state, self._stage, self._panel, self._digest = desktop, state, stage, panel, digest
        self._ui = UiInput()
        self._pointer = self._pressed_at = (0.0, 0.0)
        self._drag = ""  # what the held button does: "click", "bar", "look" or nothing
        self._looking = False  # the mouse turns the camera until Tab is pressed again

    @property
    def on_bar(self) -> bool:
        """Whether the pointer holds the split screen's bar or could take it."""
        return self._drag == "bar" or (self._over_picture() and self._near_bar())

    def on_expose(self) -> None:
        self._state.touched()

    def on_focus(self, focused: bool) -> None:
        self._state.touched()
        self._ui.focus(focused)
        if not focused:
            self._state.pilot.let_go()
            self._drag = ""
            self._look_around(False)

    def on_drop(self, paths: list[str]) -> None:
        self._state.touched()
        wish: Wish = "load preset" if paths[0].lower().endswith(SUFFIX) else "load"
        self._state.requests.append(Request(wish, paths[0]))

    def on_text(self, text: str) -> None:
        self._state.touched()
        self._ui.text(text)
        self._digest()

    def on_key(self, name: str, pressed: bool) -> None:
        self._state.touched()
        if not pressed:
            self._state.pilot.release(name)
        self._digest()  # a click just before may have ended what wanted the keyboard
        wanted = self._ui.wants_keyboard
        self._ui.key(name, pressed)
        self._digest()
        action = ACTIONS.get(name)
        function_key = name[0] == "f" and name[1:].isdigit()  # no text field has a use for those
        if pressed and action and (function_key or not wanted):
            self._act(name, action)

    def on_pointer(self, x: float, y: float, dx: float, dy: float) -> None:
        self._state.touched()
        if self._looking or self._drag == "look":
            self._state.pilot.look(dx, dy)
            return
        self._pointer = (x, y)
        self._ui.pointer(x, y)
        if self._drag == "bar":
            left, _, width, _ = self._panel.picture(self._desktop.size)
            self._state.look = replace(self._state.look, bar=min(max((x - left) / width, 0.0), 1.0))

    def on_button(self, name: str, pressed: bool) -> None:
        self._state.touched()
        self._digest()  # it must know where the pointer is before it says whose press this is
        over_picture = self._over_picture()
        self._ui.button(name, pressed)
        self._digest()
        if not pressed:
            wandered = math.dist(self._pointer, self._pressed_at)
            if self._drag == "click" and name == "left" and wandered <= CLICK_SLOP:
                self._focus_at(*self._pressed_at)
            self._drag = ""
        elif over_picture:
            self._pressed_at = self._pointer
            self._drag = {"left": "bar" if self._near_bar() else "click", "right": "look"}.get(name, "")

    def on_wheel(self, dx: float, dy: float) -> None:
        self._state.touched()
        if self._over_picture() or self._looking:
            self._state.pilot.speed = wheel_speed(self._state.pilot.speed, dy)
            self._state.say(f"fly speed {self._state.pilot.speed:.3g} m/s")
        else:
            self._ui.wheel(dx, dy)

    def _act(self, key: str, action: str) -> None:
        state = self._state
        if action.startswith("view "):
            state.look = replace(state.look, view=action.removeprefix("view "))
        elif action == "compare":
            state.look = replace(state.look, compare=not state.look.compare)
        elif action == "heat":
            state.look = replace(state.look, heat=not state.look.heat)
        elif action == "survey":
            opened = not (state.look.survey.open and state.look.panel)
            state.look = replace(state.look, panel=True, survey=replace(state.look.survey, open=opened))
        elif action == "pause":
            self._pause()
        elif action == "help":
            state.look = replace(state.look, help=not state.look.help)
        elif action == "hide_ui":
            state.look = replace(state.look, panel=not state.look.panel)
        elif action in ("reload", "screenshot"):
            state.requests.append(Request(action))  # type: ignore[arg-type]
        elif action == "toggle_look":
            self._look_around(not self._looking)
        elif action == "quit":
            self._desktop.quit()
        else:
            state.pilot.press(key)

    def _pause(self) -> None:
        state = self._state
        if not self._stage.moves:
            state.say("nothing in this scene moves")
            return
        state.playing = not state.playing
        state.say("playing" if state.playing else f"paused at {state.time_s:.2f} s")

    def _look_around(self, looking: bool) -> None:
        self._looking = looking
        self._desktop.capture_mouse(looking)

    def _over_picture(self) -> bool:
        return self._pointer[0] < self._panel.picture(self._desktop.size)[2] and not self._ui.wants_mouse

    def _near_bar(self) -> bool:
        left, _, width, _ = self._panel.picture(self._desktop.size)
        return self._state.look.compare and abs(self._pointer[0] - (left + self._state.look.bar * width)) <= BAR_GRAB

    def _focus_at(self, x: float, y: float) -> None:
        """Focus on what the picture shows there; the sky has no distance and changes nothing."""
        left, top, width, height = self._panel.picture(self._desktop.size)
        state = self._state
        depth = self._stage.depth_at((x - left) / width, (y - top) / height, state.look)
        if depth is None:
            state.say("nothing there to focus on")
        else:
            focus = in_lens_range("focus_distance", depth)
            state.look = replace(state.look, settings=put(state.look.settings, "lens.focus_distance", focus))
            state.say(f"focus at {focus:.3g} m")
