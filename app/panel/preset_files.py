"""Presets in the panel: a file's name, and buttons that save and load it."""

from __future__ import annotations

from imgui_bundle import imgui

from .model import Request


class PresetPicker:
    """Remembers the name being typed."""

    def __init__(self) -> None:
        self._typed = ""

    def draw(self, requests: list[Request]) -> None:
        """Draw the field and its buttons; what the user wants is added to `requests`."""
        imgui.set_next_item_width(-1.0)
        _, self._typed = imgui.input_text_with_hint("##preset", "name of a preset file (.json)", self._typed)
        imgui.set_item_tooltip("View and settings as a small file; a name without a folder lies where screenshots go")
        name = self._typed.strip()
        imgui.begin_disabled(not name)
        for label, wish, tip in (
            ("Save preset", "save preset", "Write this view and what differs from the defaults"),
            ("Load preset", "load preset", "Take view and settings from it. Or drop a preset on the window"),
        ):
            if imgui.button(label):
                requests.append(Request(wish, name))  # type: ignore[arg-type]
            imgui.set_item_tooltip(tip)
            imgui.same_line()
        imgui.end_disabled()
        imgui.new_line()
