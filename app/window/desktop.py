"""A window on the desktop and its events, by name: the only code that knows the library (moderngl-window on pyglet)."""

from __future__ import annotations

import os
import sys
from typing import Any, Protocol

import moderngl

from ..errors import NO_GRAPHICS, UserError
from ..gpu.context import REQUIRED

BUTTON_NAMES = {1: "left", 2: "right", 3: "middle"}  # moderngl-window's numbers
REFERENCE_DPI = 96.0  # density 1: the desktop standard that font sizes are given for


class Listener(Protocol):
    """What a window tells. Positions are window units from the top left."""

    def on_key(self, name: str, pressed: bool) -> None: ...
    def on_text(self, text: str) -> None: ...
    def on_pointer(self, x: float, y: float, dx: float, dy: float) -> None: ...
    def on_button(self, name: str, pressed: bool) -> None: ...
    def on_wheel(self, dx: float, dy: float) -> None: ...
    def on_focus(self, focused: bool) -> None: ...
    def on_drop(self, paths: list[str]) -> None: ...
    def on_expose(self) -> None: ...


def require_display() -> None:
    """Raise UserError(exit code 3) where no window can appear."""
    if sys.platform == "darwin":
        raise UserError("macOS stops at OpenGL 4.1 and has no compute shaders; use Linux or Windows", NO_GRAPHICS)
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise UserError(
            "there is no display; use `hybrid-dof shot` to render a picture without one, or set DISPLAY", NO_GRAPHICS
        )


class Desktop:
    """An open window with its OpenGL context. Raises UserError(exit code 3) if it cannot be opened."""

    def __init__(self, title: str, size: tuple[int, int]) -> None:
        require_display()
        try:
            from moderngl_window.context.pyglet.window import Window  # importing it already asks for the display
            from pyglet.app import platform_event_loop
            from pyglet.window import key

            self._key, self._events = key, platform_event_loop
            self._mglw: Any = Window(
                title=title, gl_version=divmod(REQUIRED // 10, 10), size=size, vsync=True, aspect_ratio=None
            )
        except Exception as error:  # pyglet, Xlib and glcontext each raise their own kinds
            raise UserError(
                f"no window with OpenGL 4.3 could be opened ({_reason(error)}); use `hybrid-dof shot` instead",
                NO_GRAPHICS,
            ) from error
        self._mglw.exit_key = None
        self._mglw.fullscreen_key = None
        self._pyglet: Any = self._mglw._window
        self._cursor: str | None = None

    def listen(self, listener: Listener) -> None:
        """Deliver events to `listener` from now on."""
        window, raw = self._mglw, self._pyglet
        pressed = window.keys.ACTION_PRESS
        window.key_event_func = lambda symbol, action, _: listener.on_key(self.key_name(symbol), action == pressed)
        window.unicode_char_entered_func = listener.on_text
        window.mouse_position_event_func = window.mouse_drag_event_func = listener.on_pointer
        window.mouse_press_event_func = lambda x, y, button: listener.on_button(BUTTON_NAMES[button], True)
        window.mouse_release_event_func = lambda x, y, button: listener.on_button(BUTTON_NAMES[button], False)
        window.mouse_scroll_event_func = listener.on_wheel
        window.files_dropped_event_func = lambda x, y, paths: listener.on_drop([str(path) for path in paths])
        window.resize_func = lambda width, height: listener.on_expose()
        window.iconify_func = lambda hidden: listener.on_expose()
        raw.push_handlers(
            on_activate=lambda: listener.on_focus(True),
            on_deactivate=lambda: listener.on_focus(False),
            on_expose=listener.on_expose,
        )

    def key_name(self, symbol: int) -> str:
        """pyglet's name of a key in lower case: "w", "_1", "f12", "lshift"."""
        return str(self._key.symbol_string(symbol)).lower()

    @property
    def ctx(self) -> moderngl.Context:
        return self._mglw.ctx

    @property
    def screen(self) -> moderngl.Framebuffer:
        return self._mglw.fbo

    @property
    def size(self) -> tuple[int, int]:
        """Window units."""
        return self._mglw.size

    @property
    def buffer_size(self) -> tuple[int, int]:
        """Framebuffer px."""
        return self._mglw.buffer_size

    @property
    def density(self) -> float:
        """How much larger than at 96 dots per inch text must be, in window units, which some desktops scale."""
        scaled = self.buffer_size[0] > self.size[0]
        return 1.0 if scaled else max(round(4.0 * self._pyglet.dpi / REFERENCE_DPI) / 4.0, 1.0)

    @property
    def closing(self) -> bool:
        return bool(self._mglw.is_closing)

    def set_title(self, title: str) -> None:
        if title != self._mglw.title:
            self._mglw.title = title

    def set_cursor(self, shape: str | None) -> None:
        """The pointer's shape by pyglet's name ("text", "hand", "size_left_right"); None: the usual arrow."""
        if shape != self._cursor:
            self._cursor = shape
            self._pyglet.set_mouse_cursor(self._pyglet.get_system_mouse_cursor(shape) if shape else None)

    def capture_mouse(self, captured: bool) -> None:
        """Hide the pointer and report motion without end, for looking around."""
        if captured != self._mglw.mouse_exclusivity:
            self._mglw.mouse_exclusivity = captured

    def pull_events(self) -> None:
        """Deliver what is queued, without waiting."""
        self._pyglet.dispatch_events()

    def wait(self, seconds: float) -> None:
        """Sleep until an event comes, but no longer than that, and deliver it: for a window with nothing to draw."""
        self._events.step(seconds)
        self.pull_events()

    def swap(self) -> None:
        """Show what was drawn and deliver events."""
        self._mglw.swap_buffers()

    def resize(self, size: tuple[int, int]) -> None:
        """Ask for another size [window units]; it holds when its event arrives, and the window manager may refuse."""
        self._mglw.size = size

    def quit(self) -> None:
        """Let `closing` be true from now on."""
        self._mglw.is_closing = True

    def close(self) -> None:
        self._mglw.close()


def _reason(error: Exception) -> str:
    text = str(error).strip().splitlines()
    return text[0] if text else type(error).__name__
