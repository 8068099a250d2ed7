"""Compiled shaders, one per (file, defines), checked against what their pass declares, and reloaded without losing the
last good one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import moderngl

from ..frame.records import Call
from .layout import FRAME
from .shaders import ShaderError, Source, assemble, explain, load_glsl

Program = (
    Any  # moderngl.Program or ComputeShader: both give their members by name, whose stubs are a union of all kinds
)
Key = tuple[str, tuple[tuple[str, int], ...], tuple[str, ...]]

_TOUCHED = re.compile(r"\b(?:in|prev|out)_\w+")
_PREFIXES = ("in_", "prev_", "out_")


@dataclass
class Compiled:
    """A linked program, the target names its text mentions, and the names the linker kept."""

    program: Program
    mentioned: frozenset[str]
    active: frozenset[str]
    texts: tuple[str, ...]
    checked: bool = field(default=False)


class Programs:
    """Compiles on first use. `reload` re-reads the files and swaps only what compiles."""

    def __init__(self, ctx: moderngl.Context, root: Path | None = None) -> None:
        self._ctx, self._root = ctx, root
        self._files = load_glsl(root)
        self._compiled: dict[Key, Compiled] = {}

    def __len__(self) -> int:
        return len(self._compiled)

    def get(self, shader: str, defines: Iterable[tuple[str, int]], outputs: tuple[str, ...] = ()) -> Compiled:
        """The program for a compute file, or for the `.vert`/`.frag` pair of a stem whose fragment outputs are
        `outputs` in order.
        """
        key = (shader, tuple(sorted(defines)), outputs)
        if key not in self._compiled:
            self._compiled[key] = self._build(key)
        return self._compiled[key]

    def reload(self) -> str | None:
        """Re-read all files; returns the first error, in which case that program stays as it was."""
        error = None
        try:
            self._files = load_glsl(self._root)
        except OSError as problem:
            return str(problem)
        for key, old in list(self._compiled.items()):
            try:
                if self._texts(key) == old.texts:
                    continue
                self._compiled[key] = self._build(key)
                old.program.release()
            except ShaderError as problem:
                error = error or str(problem)
        return error

    def release(self) -> None:
        for compiled in self._compiled.values():
            compiled.program.release()
        self._compiled.clear()

    def _sources(self, key: Key) -> list[Source]:
        shader, defines, _ = key
        stages = (shader,) if shader.endswith(".comp") else (f"{shader}.vert", f"{shader}.frag")
        return [assemble(stage, self._files, dict(defines)) for stage in stages]

    def _texts(self, key: Key) -> tuple[str, ...]:
        return tuple(source.text for source in self._sources(key))

    def _build(self, key: Key) -> Compiled:
        sources = self._sources(key)
        try:
            program = self._link(sources, key[2])
        except moderngl.Error as error:
            at_fault = sources[-1] if "fragment_shader" in str(error) or len(sources) == 1 else sources[0]
            raise ShaderError(f"{key[0]}: {explain(str(error), at_fault)}") from None
        text = "".join(source.text for source in sources)
        active = frozenset(program)
        if "FrameBlock" in active and (size := program["FrameBlock"].size) != FRAME.itemsize:
            raise ShaderError(
                f"{key[0]}: its FrameBlock has {size} bytes, not {FRAME.itemsize}; regenerate glsl/shared/structs.glsl"
            )
        return Compiled(
            program, frozenset(_TOUCHED.findall(_without_comments(text))), active, tuple(s.text for s in sources)
        )

    def _link(self, sources: list[Source], outputs: tuple[str, ...]) -> Program:
        if len(sources) == 1:
            return self._ctx.compute_shader(sources[0].text)
        locations = {f"out_{name}": i for i, name in enumerate(outputs)}
        return self._ctx.program(
            vertex_shader=sources[0].text, fragment_shader=sources[1].text, fragment_outputs=locations
        )


def check_names(call: Call, compiled: Compiled) -> None:
    """Raise ShaderError if the pass and its shader name different targets: a typo on either side, with the pass's
    name.
    """
    if compiled.checked:
        return
    declared = (
        {f"in_{name}" for name, _ in call.reads}
        | {f"prev_{t}" for t in call.step.history}
        | {f"out_{t}" for t in call.writes}
    )
    bound = {name for name in compiled.active if name.startswith(_PREFIXES)}
    if call.step.kind == "raster":
        bound |= {name for name in compiled.mentioned if name.startswith("out_")} & declared
    if unknown := bound - declared:
        raise ShaderError(
            f"pass {call.step.name}: {call.step.shader} uses {sorted(unknown)}, which the pass does not declare"
        )
    if unused := declared - compiled.mentioned:
        raise ShaderError(f"pass {call.step.name} declares {sorted(unused)}, which {call.step.shader} never mentions")
    compiled.checked = True


def _without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
