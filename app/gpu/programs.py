"""Compiled shaders, one per (file, defines that it mentions), checked against what their pass declares, and reloaded
all together or not at all. So many are kept; the least recently used go first.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import moderngl

from ..frame.records import Call
from ..frame.targets import BUFFERS
from .layout import FRAME
from .shaders import Key, ShaderError, Source, assemble, canonical, explain, load_glsl, stages_of, words_of

Program = (
    Any  # moderngl.Program or ComputeShader: both give their members by name, whose stubs are a union of all kinds
)

Formats = tuple[str, ...]  # of the textures that a program reads and writes, in order

MOST_PROGRAMS = 512  # kept at once: twice what two views of the richest scene can ask for within one step
_PREFIXES = ("in_", "prev_", "out_")


@dataclass
class Compiled:
    """A linked program, the targets and storage blocks that its text mentions, and the names the linker kept."""

    program: Program
    mentioned: frozenset[str]
    active: frozenset[str]
    blocks: frozenset[str]  # those of the names kept that are storage blocks
    texts: tuple[str, ...]
    fits: dict[str, Call] = field(default_factory=dict)  # the passes, by name, whose names were found to match
    ran: set[Formats] = field(default_factory=set)  # with textures of which formats, as drivers compile for them then


class Programs:
    """Compiles on first use and keeps `most`, which must be more than a frame of each renderer that shares it needs.

    Renderers of one context may share it: every use of a program binds all that it reads and writes.
    """

    def __init__(self, ctx: moderngl.Context, root: Path | None = None, most: int = MOST_PROGRAMS) -> None:
        self._ctx, self._root, self._most = ctx, root, most
        self._files = load_glsl(root)
        self._compiled: dict[Key, Compiled] = {}  # the least recently used first
        self._asked: dict[Key, Key] = {}  # with all the defines it was asked for by -> with those that it mentions
        self.losses = 0  # grows when programs go: what was found ready until then may no longer be
        self.builds = 0  # compiled so far
        self.first_runs = 0  # of programs on textures of new formats, so far

    def __len__(self) -> int:
        return len(self._compiled)

    def key(self, shader: str, defines: Iterable[tuple[str, int]], outputs: tuple[str, ...] = ()) -> Key:
        """What tells this program from others."""
        asked = (shader, tuple(sorted(defines)), outputs)
        if asked not in self._asked:
            self._asked[asked] = canonical(asked, self._files)
        return self._asked[asked]

    def get(self, shader: str, defines: Iterable[tuple[str, int]], outputs: tuple[str, ...] = ()) -> Compiled:
        """The program for a compute file, or for the `.vert`/`.frag` pair of a stem whose fragment outputs are
        `outputs` in order.
        """
        key = self.key(shader, defines, outputs)
        compiled = self._compiled.pop(key, None) or self._build(key, self._files)
        self._compiled[key] = compiled
        while len(self._compiled) > self._most:
            self._drop(next(iter(self._compiled)))
        return compiled

    def holds(self, shader: str) -> bool:
        """Whether a program without defines is compiled."""
        return self.key(shader, ()) in self._compiled

    def has_run(self, key: Key, formats: Formats) -> bool:
        """Whether a program is ready to run on textures of these formats without compiling anything. Asking counts as a
        use.
        """
        compiled = self._compiled.pop(key, None)
        if compiled is None:
            return False
        self._compiled[key] = compiled
        return formats in compiled.ran

    def runs(self, compiled: Compiled, formats: Formats) -> None:
        """Note that a program is about to run: most drivers put off the larger part of compiling until then."""
        if formats not in compiled.ran:
            compiled.ran.add(formats)
            self.first_runs += 1

    def reload(self) -> str | None:
        """Re-read all files and swap what changed. Returns what is wrong with them, in which case nothing changes: the
        last good programs go on, and whatever is compiled next is of their text.
        """
        made: list[Compiled] = []
        try:
            files = load_glsl(self._root)
            asked = {wish: canonical(wish, files) for wish, key in self._asked.items() if key in self._compiled}
            found: dict[Key, Compiled] = {}
            for wish, key in asked.items():
                if key not in found:
                    found[key] = self._renewed(key, self._compiled[self._asked[wish]], files, made)
        except (ShaderError, OSError) as problem:
            for compiled in made:
                compiled.program.release()
            return str(problem)
        kept = {id(compiled) for compiled in found.values()}
        for compiled in self._compiled.values():
            if id(compiled) not in kept:
                compiled.program.release()
        self._files, self._asked, self._compiled = files, asked, found
        self.losses += 1
        return None

    def release(self) -> None:
        for compiled in self._compiled.values():
            compiled.program.release()
        self._compiled.clear()
        self._asked.clear()

    def _drop(self, key: Key) -> None:
        self._compiled.pop(key).program.release()
        self.losses += 1
        self._asked = {asked: found for asked, found in self._asked.items() if found != key}

    def _renewed(self, key: Key, old: Compiled, files: Mapping[str, str], made: list[Compiled]) -> Compiled:
        """The program of these files, which is the old one if its text is the same, and else is added to `made`."""
        if tuple(source.text for source in _sources(key, files)) == old.texts:
            return old
        made.append(self._build(key, files))
        for call in old.fits.values():
            check_names(call, made[-1])
        return made[-1]

    def _build(self, key: Key, files: Mapping[str, str]) -> Compiled:
        self.builds += 1
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
        blocks = frozenset(name for name in active if isinstance(program[name], moderngl.StorageBlock))
        return Compiled(program, _mentioned(text), active, blocks, tuple(s.text for s in sources))

    def _link(self, sources: list[Source], outputs: tuple[str, ...]) -> Program:
        if len(sources) == 1:
            return self._ctx.compute_shader(sources[0].text)
        locations = {f"out_{name}": i for i, name in enumerate(outputs)}
        return self._ctx.program(
            vertex_shader=sources[0].text, fragment_shader=sources[1].text, fragment_outputs=locations
        )


def _sources(key: Key, files: Mapping[str, str]) -> list[Source]:
    shader, defines, _ = key
    return [assemble(stage, files, dict(defines)) for stage in stages_of(shader)]


def check_names(call: Call, compiled: Compiled) -> None:
    """Raise ShaderError if the pass and its shader name different targets or storage blocks: a typo on either side,
    with the pass's name.
    """
    fit = compiled.fits.get(call.step.name)
    if fit and fit.step is call.step and (fit.reads, fit.writes) == (call.reads, call.writes):
        return
    blocks = {*call.step.takes, *call.step.fills}
    declared = (
        {f"in_{name}" for name, _ in call.reads}
        | {f"prev_{t}" for t in call.step.history}
        | {f"out_{t}" for t in call.writes}
        | blocks
    )
    bound = (compiled.blocks & BUFFERS.keys()) if call.step.scene else compiled.blocks  # the scene binds its own
    bound |= {name for name in compiled.active if name.startswith(_PREFIXES)}
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


def _mentioned(text: str) -> frozenset[str]:
    """Names of targets, with their prefixes, and of storage blocks."""
    words = words_of(_without_comments(text))
    return frozenset(word for word in words if word.startswith(_PREFIXES) or word in BUFFERS)


def _without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
