"""Compiled shaders, one per (file, defines), checked against what their pass declares, and reloaded all together or not
at all.

Whatever can be compiled in another way can be in many: the least recently used permutations go when there are too many.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
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

LIMIT = 256  # programs that are kept: some six frames' worth of permutations, a few MB on a software rasteriser

_TOUCHED = re.compile(r"\b(?:in|prev|out)_\w+")
_PREFIXES = ("in_", "prev_", "out_")


@dataclass
class Compiled:
    """A linked program, the target names its text mentions, and the names the linker kept."""

    program: Program
    mentioned: frozenset[str]
    active: frozenset[str]
    texts: tuple[str, ...]
    fits: dict[str, Call] = field(default_factory=dict)  # the passes, by name, whose names were found to match


class Programs:
    """Compiles on first use. Renderers on one context may share one."""

    def __init__(self, ctx: moderngl.Context, root: Path | None = None, limit: int = LIMIT) -> None:
        """`limit` must be more than one frame of every renderer that shares it needs."""
        self._ctx, self._root, self._limit = ctx, root, limit
        self._files = load_glsl(root)
        self._compiled: dict[Key, Compiled] = {}  # the least recently used first

    def __len__(self) -> int:
        return len(self._compiled)

    def get(self, shader: str, defines: Iterable[tuple[str, int]], outputs: tuple[str, ...] = ()) -> Compiled:
        """The program for a compute file, or for the `.vert`/`.frag` pair of a stem whose fragment outputs are
        `outputs` in order.
        """
        key = (shader, tuple(sorted(defines)), outputs)
        found = self._compiled.pop(key, None) or self._build(key, self._files)
        self._compiled[key] = found
        while len(self._compiled) > self._limit:
            self._compiled.pop(next(iter(self._compiled))).program.release()
        return found

    def reload(self) -> str | None:
        """Re-read all files and swap what changed. Returns what is wrong with them, in which case nothing changes: the
        last good programs go on, and whatever is compiled next is of their text.
        """
        made: dict[Key, Compiled] = {}
        try:
            files = load_glsl(self._root)
            for key, old in self._compiled.items():
                if tuple(source.text for source in _sources(key, files)) != old.texts:
                    made[key] = self._build(key, files)
                    for call in old.fits.values():
                        check_names(call, made[key])
        except (ShaderError, OSError) as problem:
            for compiled in made.values():
                compiled.program.release()
            return str(problem)
        for key, compiled in made.items():
            self._compiled[key].program.release()
            self._compiled[key] = compiled
        self._files = files
        return None

    def release(self) -> None:
        for compiled in self._compiled.values():
            compiled.program.release()
        self._compiled.clear()

    def _build(self, key: Key, files: Mapping[str, str]) -> Compiled:
        sources = _sources(key, files)
        try:
            program = self._link(sources, key[2])
        except moderngl.Error as error:
            at_fault = sources[-1] if "fragment_shader" in str(error) or len(sources) == 1 else sources[0]
            raise ShaderError(f"{key[0]}: {explain(str(error), at_fault)}") from None
        text = "".join(source.text for source in sources)
        active = frozenset(program)
        if "FrameBlock" in active and (size := program["FrameBlock"].size) != FRAME.itemsize:
            program.release()
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


def _sources(key: Key, files: Mapping[str, str]) -> list[Source]:
    shader, defines, _ = key
    stages = (shader,) if shader.endswith(".comp") else (f"{shader}.vert", f"{shader}.frag")
    return [assemble(stage, files, dict(defines)) for stage in stages]


def check_names(call: Call, compiled: Compiled) -> None:
    """Raise ShaderError if the pass and its shader name different targets: a typo on either side, with the pass's
    name.
    """
    if compiled.fits.get(call.step.name) == call:
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
    compiled.fits[call.step.name] = call


def give(program: Program, **values: object) -> None:
    """Set uniforms by name, outside a plan's passes; one that the compiler dropped takes no value."""
    for name in values.keys() & set(program):
        program[name] = values[name]


def _without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
