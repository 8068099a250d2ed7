"""The scene picker: built-in scenes, a typed or dropped path, the cameras of a scene, and what loading found."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from imgui_bundle import imgui

from ..camera import Viewpoint, read_viewpoint
from ..errors import UserError
from ..files import is_file
from ..scene import gallery
from ..scene.stress.catalogue import STRESS, Stress
from ..scene.validate import count
from . import style
from .costs import muted
from .model import Request, Shown


def camera_files(scene_path: str | Path) -> tuple[Viewpoint, ...]:
    """The viewpoints of the camera files (.json) beside a scene file; files that are no camera are passed over.

    A file named after the scene comes first, then others that start with the scene's name, then the rest.
    """
    path = Path(scene_path)
    if not is_file(path):
        return ()
    found = []
    for file in sorted(
        path.parent.glob("*.json"), key=lambda f: (f.stem != path.stem, not f.stem.startswith(path.stem), f.name)
    ):
        try:
            found.append(read_viewpoint(file))
        except UserError:
            continue
    return tuple(found)


class ScenePicker:
    """Remembers the path being typed."""

    def __init__(self) -> None:
        self._typed = ""

    def draw(self, shown: Shown, requests: list[Request]) -> None:
        """Draw the picker; what the user picks is added to `requests`."""
        imgui.set_next_item_width(-1.0)
        if imgui.begin_combo("##scene", Path(shown.scene).name or "choose a scene"):
            _entries(gallery.SCENES, shown, requests)
            imgui.separator_text("made to be hard")
            _entries(STRESS, shown, requests)
            imgui.end_combo()
        else:
            imgui.set_item_tooltip("Built-in scenes. Or drop a .glb .gltf .obj .ply .stl file on the window")
        self._path(requests)
        if shown.load_error:
            style.wrapped(shown.load_error, style.ERROR)
        _cameras(shown.viewpoints, requests)
        _report(shown)

    def _path(self, requests: list[Request]) -> None:
        imgui.set_next_item_width(imgui.get_content_region_avail().x - 4.0 * imgui.get_font_size())
        flags = imgui.InputTextFlags_.enter_returns_true
        entered, self._typed = imgui.input_text_with_hint("##path", "path of a scene file", self._typed, flags)
        imgui.set_item_tooltip("Type a path and press Enter, or drop a file on the window")
        imgui.same_line()
        if (imgui.button("Open", imgui.ImVec2(-1.0, 0.0)) or entered) and self._typed.strip():
            requests.append(Request("load", self._typed.strip()))


def _entries(entries: Iterable[gallery.BuiltIn | Stress], shown: Shown, requests: list[Request]) -> None:
    for entry in entries:
        if imgui.selectable(entry.name, entry.name == shown.scene)[0]:
            requests.append(Request("load", entry.name))
        imgui.set_item_tooltip(entry.description)


def _cameras(viewpoints: Iterable[Viewpoint], requests: list[Request]) -> None:
    imgui.set_next_item_width(imgui.get_content_region_avail().x - 4.0 * imgui.get_font_size())
    if imgui.begin_combo("##camera", "go to a camera"):
        for index, viewpoint in enumerate(viewpoints):
            if imgui.selectable(f"{viewpoint.name or index + 1}##{index}", False)[0]:
                requests.append(Request("viewpoint", viewpoint=viewpoint))
            focus, aperture = viewpoint.focus_distance, viewpoint.aperture
            parts = (f"focus {focus:g} m" if focus else "", f"aperture {aperture:g} m" if aperture else "")
            imgui.set_item_tooltip(", ".join(part for part in parts if part) or "keeps focus and aperture")
        imgui.end_combo()
    else:
        imgui.set_item_tooltip("The scene's own cameras, and the camera files (.json) beside it")
    imgui.same_line()
    if imgui.button("Save##camera", imgui.ImVec2(-1.0, 0.0)):
        requests.append(Request("save camera"))
    imgui.set_item_tooltip("Write this viewpoint, focus and aperture as a camera file (.json) where screenshots go")


def _report(shown: Shown) -> None:
    report = shown.report
    if report is None:
        return
    muted(f"{report.triangles:,} triangles, {report.vertices:,} vertices, loaded in {report.seconds:.1f} s")
    if report.degenerate:
        muted(f"{report.degenerate:,} degenerate triangles dropped")
    if report.notes and imgui.tree_node(f"{count(len(report.notes), 'note')} from loading###notes"):
        for note in report.notes:
            muted(f"- {note}")
        imgui.tree_pop()
