"""Named keys, buttons and text for Dear ImGui, which decides first whether an event was meant for it."""

from __future__ import annotations

from imgui_bundle import imgui

# Where a window's key name is not already ImGui's.
_ALIASES = {
    "return": "enter",
    **{f"{side[0]}{key}": f"{side}_{key}" for side in ("left", "right") for key in ("shift", "ctrl", "alt")},
    **{f"{side[0]}{key}": f"{side}_super" for side in ("left", "right") for key in ("windows", "command", "meta")},
    **{f"{side[0]}option": f"{side}_alt" for side in ("left", "right")},
    **{arrow: f"{arrow}_arrow" for arrow in ("left", "right", "up", "down")},
    **{f"page{way}": f"page_{way}" for way in ("up", "down")},
    **{f"{lock}lock": f"{lock}_lock" for lock in ("caps", "num", "scroll")},
    **{f"bracket{side}": f"{side}_bracket" for side in ("left", "right")},
    **{f"num_{key}": f"keypad_{key}" for key in ("enter", "add", "subtract", "multiply", "divide", "decimal", "equal")},
    **{f"num_{digit}": f"keypad{digit}" for digit in range(10)},
    "print": "print_screen",
    "grave": "grave_accent",
    "quoteleft": "grave_accent",
}
_MODIFIERS = {
    "shift": imgui.Key.mod_shift,
    "ctrl": imgui.Key.mod_ctrl,
    "alt": imgui.Key.mod_alt,
    "super": imgui.Key.mod_super,
}
BUTTONS = {"left": 0, "right": 1, "middle": 2}


def imgui_key(name: str) -> imgui.Key | None:
    """ImGui's key for a key name (see app/controls.py), or None for keys it does not know."""
    found = getattr(imgui.Key, _ALIASES.get(name, name), None)
    return found if isinstance(found, imgui.Key) else None


class UiInput:
    """Feeds the current ImGui context and says what it wants for itself."""

    def __init__(self) -> None:
        self._io = imgui.get_io()
        self._down: set[imgui.Key] = set()

    @property
    def wants_mouse(self) -> bool:
        return bool(self._io.want_capture_mouse)

    @property
    def wants_keyboard(self) -> bool:
        return bool(self._io.want_capture_keyboard)

    def key(self, name: str, pressed: bool) -> None:
        """A key went down or up; modifiers follow the keys, since a window's own flags lag behind by one event."""
        key = imgui_key(name)
        if key is None:
            return
        (self._down.add if pressed else self._down.discard)(key)
        for modifier, flag in _MODIFIERS.items():
            sides = {getattr(imgui.Key, f"left_{modifier}"), getattr(imgui.Key, f"right_{modifier}")}
            self._io.add_key_event(flag, bool(sides & self._down))
        self._io.add_key_event(key, pressed)

    def text(self, text: str) -> None:
        for character in text:
            if character >= " " and character != "\x7f":
                self._io.add_input_character(ord(character))

    def pointer(self, x: float, y: float) -> None:
        """The pointer is at (x, y) window units from the top left."""
        self._io.add_mouse_pos_event(x, y)

    def button(self, name: str, pressed: bool) -> None:
        self._io.add_mouse_button_event(BUTTONS[name], pressed)

    def wheel(self, dx: float, dy: float) -> None:
        self._io.add_mouse_wheel_event(dx, dy)

    def focus(self, focused: bool) -> None:
        """The window got or lost the keyboard; ImGui releases what was held on loss."""
        self._down.clear()
        self._io.add_focus_event(focused)
