"""Shader text: `#include` and defines assembled into one string that remembers where each line came from.

An include stands at the top of a file, names a path relative to `glsl/`, and is taken once. Driver messages name lines
of the assembled text; `explain` turns them back into the file and line a person wrote.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ..data import data_dir
from ..errors import NO_GRAPHICS, UserError

Key = tuple[str, tuple[tuple[str, int], ...], tuple[str, ...]]  # shader, defines in order, fragment outputs

VERSION = "#version 430 core"
SUFFIXES = (".glsl", ".comp", ".vert", ".frag")

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
# Mesa "0:12(3): error", NVIDIA "0(12) : error", others "ERROR: 0:12: 'x'".
_LOCATION = re.compile(r"^(?P<head>(?:ERROR|WARNING):\s*)?\d+[:(](?P<line>\d+)\)?(?:\(\d+\))?\s*:")
_WORD = re.compile(r"[A-Za-z_]\w*")


class ShaderError(UserError):
    """A shader that cannot be assembled, compiled or bound; the message names the real file and line.

    A person meets it as one: a broken edit shows in the window, and a driver that refuses a shader ends in a sentence.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message, NO_GRAPHICS)


@dataclass(frozen=True)
class Source:
    """Assembled text, with the (file, line) each of its lines came from."""

    text: str
    origin: tuple[tuple[str, int], ...]


def load_glsl(root: Path | None = None) -> dict[str, str]:
    """All shader files under `root` (default: the ones shipped), keyed by path relative to it.

    Raises OSError, and ShaderError for one that holds no text, naming file and line.
    """
    root = root or data_dir("glsl")
    return {p.relative_to(root).as_posix(): _text(p, root) for p in sorted(root.rglob("*")) if p.suffix in SUFFIXES}


def _text(path: Path, root: Path) -> str:
    data = path.read_bytes()
    try:
        text = data.decode("utf-8")
        fault = data.find(b"\0")  # where a driver would stop reading
    except UnicodeDecodeError as error:
        fault = error.start
    if fault >= 0:
        line = 1 + data.count(b"\n", 0, fault)
        raise ShaderError(f"{path.relative_to(root).as_posix()}:{line}: this is no text; save the file as UTF-8")
    return text.replace("\r\n", "\n")


def assemble(entry: str, files: Mapping[str, str], defines: Mapping[str, object] | None = None) -> Source:
    """Expand `entry` and its includes below a header of defines (booleans become 0 or 1).

    Raises ShaderError for a missing file or an include cycle, naming the file and line that asked for it.
    """
    lines, origin = [VERSION], [("<version>", 1)]
    for name, value in sorted((defines or {}).items()):
        lines.append(f"#define {name} {int(value) if isinstance(value, bool) else value}")
        origin.append(("<defines>", 1))
    seen: set[str] = set()

    def emit(name: str, trail: tuple[str, ...], asked: str) -> None:
        if name in trail:
            raise ShaderError(f"{asked}: include cycle: {' -> '.join((*trail, name))}")
        if name in seen:
            return
        if name not in files:
            raise ShaderError(f'{asked}: no shader file "{name}"')
        seen.add(name)
        for number, line in enumerate(files[name].splitlines(), 1):
            if include := _INCLUDE.match(line):
                emit(include[1], (*trail, name), f"{name}:{number}")
            else:
                lines.append(line)
                origin.append((name, number))

    emit(entry, (), "<plan>")
    return Source("\n".join(lines) + "\n", tuple(origin))


def explain(log: str, source: Source) -> str:
    """A driver's message with assembled line numbers replaced by `file:line:`."""

    def locate(line: str) -> str:
        match = _LOCATION.match(line)
        if not match or not 1 <= int(match["line"]) <= len(source.origin):
            return line
        file, number = source.origin[int(match["line"]) - 1]
        return f"{file}:{number}:{line[match.end() :]}"

    return "\n".join(locate(line) for line in log.splitlines())


def stages_of(shader: str) -> tuple[str, ...]:
    """The files of a compute shader, or of the stem of a `.vert` and a `.frag`."""
    return (shader,) if shader.endswith(".comp") else (f"{shader}.vert", f"{shader}.frag")


def canonical(key: Key, files: Mapping[str, str]) -> Key:
    """The same program by the defines that its files mention: no other makes a difference to it."""
    shader, defines, outputs = key
    words: set[str] = set()
    for name in _included(stages_of(shader), files):
        if name not in files:
            return key  # unknown what it would mention; `assemble` complains of it
        words |= _words(files[name])
    return shader, tuple(define for define in defines if define[0] in words), outputs


def _included(entries: tuple[str, ...], files: Mapping[str, str]) -> set[str]:
    """The names of some files and of all that they include, there or not."""
    seen, waiting = set(entries), list(entries)
    while waiting:
        fresh = _includes(files.get(waiting.pop(), "")) - seen
        seen |= fresh
        waiting += fresh
    return seen


def words_of(text: str) -> frozenset[str]:
    """Every name and keyword of a text."""
    return frozenset(_WORD.findall(text))


# of files: a few times as many texts as there are, for those that are being edited
_words = lru_cache(maxsize=512)(words_of)


@lru_cache(maxsize=512)
def _includes(text: str) -> frozenset[str]:
    return frozenset(match[1] for match in map(_INCLUDE.match, text.splitlines()) if match)
