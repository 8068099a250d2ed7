"""The nouns of a frame: targets, passes, and the plan made of them. Pure values, no GL.

A shader names what it touches after the target: `in_<target>` samplers, `prev_<target>` samplers of last frame's value,
`out_<target>` images (or fragment outputs), `BufferName` blocks. A read may be renamed: "color=lit" binds target `lit`
to `in_color`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from ..scene.facts import Facts
from ..settings import Settings

Show = Literal["color", "signed", "scalar", "normal", "vector"]


@dataclass(frozen=True)
class Target:
    """A texture that passes write. `scale`: full resolution divided by this. `history`: last frame's value stays
    readable.
    """

    name: str
    components: int
    dtype: Literal["f1", "f2", "f4", "depth"]
    meaning: str  # of a texel, with its unit
    scale: int = 1
    fixed: tuple[int, int] | None = None  # (width, height) in texels, whatever the picture's size
    history: bool = False
    signed: str = ""  # those of its components xyzw that may be negative
    cleared: bool = False  # zeroed before the pass that writes it, which writes only parts of it
    filter: Literal["nearest", "linear"] = "linear"
    show: Show = "color"  # how the target viewer paints it
    range: tuple[float, float] = (0.0, 1.0)  # its colour map's ends


@dataclass(frozen=True)
class Buffer:
    """A storage block that passes share: `bytes_per_pixel` of the target `scale`, after `header` bytes that are zeroed
    each frame.
    """

    name: str
    meaning: str
    header: int
    bytes_per_pixel: int = 0
    scale: int = 1


@dataclass(frozen=True)
class Need:
    """Whether a pass runs, and the reason in words."""

    runs: bool
    reason: str


Defines = tuple[tuple[str, int], ...]
Kernels = tuple[tuple[int, Defines], ...]  # (place of its group counts in the block, what only this one compiles)
KERNEL_BYTES = 16  # between the group counts of kernels: three, and how many items there are
Permutation = tuple[str, Defines, tuple[str, ...]]  # shader, defines, fragment outputs in order


def always(settings: Settings, facts: Facts) -> Need:
    """The default: needed whenever something reads what it writes."""
    return Need(True, "its output is read")


def no_defines(settings: Settings, facts: Facts) -> Defines:
    """The default: one permutation."""
    return ()


def one_kernel(settings: Settings, facts: Facts) -> Kernels:
    """The default: all work is of one kind."""
    return ((0, ()),)


@dataclass(frozen=True)
class Pass:
    """One step of a frame as data. Compute passes cover `grid` (default: their first output) in work groups of `group`
    texels.
    """

    name: str
    shader: str  # path under glsl/; raster passes name the stem of a .vert and a .frag
    writes: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()  # read if something writes them; the shader sees HAS_<TARGET> as 1 or 0
    history: tuple[str, ...] = ()  # last frame's values, bound as prev_<target>
    updates: tuple[str, ...] = ()  # read and written in place, and kept between frames
    # (history, optional read): written over last frame's value, texel by texel, unless that is read
    in_place_without: tuple[tuple[str, str], ...] = ()
    buffers: tuple[str, ...] = ()  # storage blocks it reads, beside the one that it runs over
    fills: tuple[str, ...] = ()  # storage blocks it writes (and may read)
    kind: Literal["compute", "raster"] = "compute"
    scene: bool = False  # reads materials, lights or textures
    rays: bool = False  # traverses the BVH
    sliced: bool = False  # may be dispatched a band of rows at a time (frame.slice_begin, slice_end)
    grid: str = ""
    group: tuple[int, int] = (8, 8)
    over: str = ""  # storage block of the work to cover instead of a grid: group counts for each kernel, then items
    needed: Callable[[Settings, Facts], Need] = always
    defines: Callable[[Settings, Facts], Defines] = no_defines
    kernels: Callable[[Settings, Facts], Kernels] = one_kernel  # over that work, in Call.parts
    writes_if: tuple[tuple[str, Callable[[Settings, Facts], bool]], ...] = ()  # outputs that exist only for some scenes
    offers: tuple[str, ...] = ()  # outputs written only if a pass that runs reads them; the shader sees HAS_<TARGET>

    @property
    def takes(self) -> tuple[str, ...]:
        """Storage blocks that must be filled before."""
        return (*self.buffers, self.over) if self.over else self.buffers

    def outputs(self, settings: Settings, facts: Facts) -> tuple[str, ...]:
        """What it writes for this scene: `writes`, the `writes_if` that apply, and `updates` (textures only)."""
        return (*self.writes, *(t for t, applies in self.writes_if if applies(settings, facts)), *self.updates)


@dataclass(frozen=True)
class Call:
    """A pass as it will run: inputs resolved, permutations fixed."""

    step: Pass
    reads: tuple[tuple[str, str], ...]  # (sampler name without prefix, target)
    writes: tuple[str, ...]
    defines: Defines
    reason: str
    in_place: tuple[str, ...] = ()  # histories that it writes over last frame's value
    kernels: Kernels = ((0, ()),)

    @cached_property
    def parts(self) -> tuple[Call, ...]:
        """One call for each kernel: what is compiled and dispatched by itself."""
        if len(self.kernels) == 1:
            return (self,)
        return tuple(replace(self, kernels=(kernel,)) for kernel in self.kernels)

    @property
    def shadowed(self) -> bool:
        """Whether it reads the sun's shadow map."""
        return bool(dict(self.defines).get("SHADOWS"))

    @property
    def counts(self) -> tuple[str, int] | None:
        """Where a part finds its group counts, if it covers no grid: block and byte offset."""
        return (self.step.over, KERNEL_BYTES * self.kernels[0][0]) if self.step.over else None

    @property
    def program(self) -> Permutation:
        """What a part compiles, but for what the scene on the GPU adds (app/gpu/scene.py: defines)."""
        defines = (*self.defines, *self.kernels[0][1])
        return self.step.shader, defines, self.writes if self.step.kind == "raster" else ()


@dataclass(frozen=True)
class Skipped:
    """A pass that does not run, and why."""

    name: str
    reason: str
    shader: str


@dataclass(frozen=True)
class FramePlan:
    """What draws one frame, in order, and what was left out."""

    calls: tuple[Call, ...]
    output: str  # the target to look at
    skipped: tuple[Skipped, ...] = ()

    @cached_property
    def parts(self) -> tuple[Call, ...]:
        """The parts of all calls, in order."""
        return tuple(part for call in self.calls for part in call.parts)

    @property
    def reasons(self) -> dict[str, str]:
        """By pass: why it runs, or why not."""
        return {**{c.step.name: c.reason for c in self.calls}, **{s.name: s.reason for s in self.skipped}}

    @property
    def targets(self) -> frozenset[str]:
        """Every target the frame touches."""
        return frozenset(
            t for call in self.calls for t in (*(t for _, t in call.reads), *call.writes, *call.step.history)
        )


def split_read(read: str) -> tuple[str, str]:
    """("color", "lit") from "color=lit"; ("depth", "depth") from "depth"."""
    name, _, target = read.partition("=")
    return name, target or name
