"""What an OBJ asks for in vain, read from its text: trimesh goes on without a word, or tells it in words of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..errors import quoted
from ..files import is_file
from .images import readable

MOST_NAMES = 8  # of missing materials in a note
MOST_OF_KEY = 8  # characters of a line that may hold its keyword
MOST_DIGITS = 18  # of a vertex number; Python refuses to read thousands


def missing_assets(path: Path) -> list[str]:
    """A note for each material library, material or diffuse map that the OBJ names and trimesh does without."""
    libraries: list[str] = []
    used: dict[str, None] = {}  # in order, each once
    for key, value in _lines(path, "mtllib", "usemtl"):
        if key == "mtllib":
            libraries.append(value)
        elif value:
            used[_name(value)] = None
    notes = []
    for library in libraries:
        found = _beside(path, library)
        if found is None:
            lost = f"Material library '{quoted(library)}' is missing or outside the folder"
            notes.append(f"{lost}; plain materials are used.")
            continue
        notes += _missing_textures(path, found)
    return notes + _missing_materials(path, libraries, list(used))


def _missing_textures(path: Path, library: Path) -> list[str]:
    notes = []
    for _, texture in _lines(library, "map_kd"):
        picture = _beside(path, texture)
        if picture is None or not readable(picture):
            what = "missing or outside the folder" if picture is None else "no picture that can be read, or too large"
            notes.append(f"Texture '{quoted(texture)}' is {what}; the plain colour is used.")
    return notes


def _missing_materials(path: Path, libraries: list[str], used: list[str]) -> list[str]:
    """A note on the materials that faces use and nothing defines; trimesh reads the first library alone."""
    if not libraries:
        return ["The file names no material library: a plain material is used."] if used else []
    library = _beside(path, libraries[0])
    if library is None:
        return []  # which is noted
    defined = {_name(value) for _, value in _lines(library, "newmtl")}
    lost = [f"'{quoted(name)}'" for name in used if name not in defined]
    if not lost:
        return []
    named = ", ".join(lost[:MOST_NAMES]) + (f" and {len(lost) - MOST_NAMES} others" if len(lost) > MOST_NAMES else "")
    are = "Material {} is" if len(lost) == 1 else "Materials {} are"
    return [f"{are.format(named)} not in the material library '{quoted(libraries[0])}'; a plain one is used."]


def missing_vertex(path: Path) -> str | None:
    """Which line of an OBJ refers to a vertex that the file does not have, by the number that stands there."""
    count = sum(1 for _ in _lines(path, "v"))
    with path.open(encoding="utf-8", errors="replace") as text:
        for number, line in enumerate(text, 1):
            words = line.split()
            for corner in words[1:] if words[:1] == ["f"] else ():
                index = corner.split("/")[0]
                digits = index.removeprefix("-")
                if digits.isdecimal() and not (len(digits) <= MOST_DIGITS and 1 <= int(digits) <= count):
                    return f"line {number}: a face refers to vertex {quoted(index)}, but the file has {count}"
    return None


def _name(value: str) -> str:
    """A material's name as trimesh compares it."""
    return " ".join(value.split())


def _beside(path: Path, name: str) -> Path | None:
    """The file of that name in the model's folder or below; None if there is none."""
    target = path.parent / name.strip().lstrip("/")
    return target if is_file(target) and target.resolve().is_relative_to(path.parent.resolve()) else None


def _lines(path: Path, *keys: str) -> Iterator[tuple[str, str]]:
    """(key, what follows it) of each line of a text file that starts with one of the keys, in either case."""
    with path.open(encoding="utf-8", errors="replace") as text:
        for line in text:
            if not line[:MOST_OF_KEY].lstrip().lower().startswith(keys):
                continue
            for key in keys:
                if line[: len(key) + 1].strip().lower() == key:
                    yield key, line.strip()[len(key) :].strip()
