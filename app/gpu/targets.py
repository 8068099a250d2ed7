"""The textures and storage blocks behind the tables of app.frame.targets: taken when a frame begins or on first use,
owned here, released here.

`begin` deals out textures to the slots of a plan (app/frame/lifetimes.py), where several targets may follow one another
in one texture. A target that was named without it has a texture to itself.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import moderngl
import numpy as np

from ..errors import UserError
from ..frame.lifetimes import BEFORE, PICKED, Format, Slot, Value, format_of
from ..frame.memory import buffer_bytes, format_bytes, texels
from ..frame.targets import BUFFERS, DEPTH_TEST, TARGETS
from ..optics import SKY_DEPTH
from .context import leave_framebuffers
from .memory import check_frame, check_made
from .pool import IDLE_FRAMES, Key, Pool

_NUMPY = {"f1": np.uint8, "f2": np.float16, "f4": np.float32}
_FILTER = {"nearest": (moderngl.NEAREST, moderngl.NEAREST), "linear": (moderngl.LINEAR, moderngl.LINEAR)}

IDLE = "kept for a while, unused"  # how `bytes` names what no target of the frame needs
DISPATCH_HEADER = np.array([0, 1, 1, 0], "<u4").tobytes()  # no groups yet in x, one in y and z; no items


class Overwritten(RuntimeError):
    """A value was asked for after its texture had been used for another."""


class Targets:
    """All per-size GPU storage of one renderer. Sizes are (width, height) in full-resolution px."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        self._ctx = ctx
        self._pool = Pool(ctx, self._forget_framebuffers)
        self._textures: dict[Value, moderngl.Texture] = {}  # what is there now; shared ones stand several times
        self._overwritten: dict[Value, str] = {}  # gone by the frame's end, and what its texture holds then
        self._buffers: dict[str, moderngl.Buffer] = {}
        self._idle_buffers: dict[str, int] = {}  # frames that began without them
        self._framebuffers: dict[tuple[int, ...], moderngl.Framebuffer] = {}  # by the GL names of their textures
        self.size = self._checked(size)

    def _checked(self, size: tuple[int, int]) -> tuple[int, int]:
        limit = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
        if min(size) < 1 or max(size) > limit:
            raise UserError(f"--size {size[0]}x{size[1]}: each side must be from 1 to {limit} pixels on this device")
        return size

    def resize(self, size: tuple[int, int]) -> None:
        """Forget everything and start at a new size."""
        size = self._checked(size)
        self.release()
        self.size = size

    # -- a frame -------------------------------------------------------------------------------------------------------

    def reserve(self, slots: Sequence[Slot], blocks: Collection[str]) -> None:
        """Raise UserError if a frame does not fit into memory, before any is made. What waits unused gives way."""
        try:
            check_frame(self._ctx, self._missing(slots, blocks), self.size)
        except UserError:
            self._pool.release_unused(self._used())
            check_frame(self._ctx, self._missing(slots, blocks), self.size)

    def begin(self, slots: Sequence[Slot], blocks: Collection[str]) -> None:
        """Give each slot of a frame its texture: what the frame before left in one stays there, all else is given
        back. A value that should be there from before and is not begins as zeroes.
        """
        before = {value: t for value, t in self._textures.items() if value not in self._overwritten}
        self._textures = {v: before[v] for v in self._picked(slots) if v in before}
        kept = [_left_by(slot, before) for slot in slots]
        used = {texture.glo for texture in (*self._textures.values(), *kept) if texture}
        for slot, texture in zip(slots, kept, strict=True):
            if texture is None:
                texture, new = self._pool.take(self._key(slot.format), used, self.size, f"the target {slot.names[0]!r}")
                used.add(texture.glo)
                if slot.lives[0].first == BEFORE and not new:
                    self._clear(texture)
            self._textures |= {value: texture for life in slot.lives for value in life.values}
        self._overwritten = {
            v: slot.lives[-1].target.name for slot in slots for life in slot.lives[:-1] for v in life.values
        }
        self._pool.begin_frame(used)
        self._begin_buffers(blocks)

    def forget(self, names: Collection[str]) -> None:
        """Drop the values of some targets: where the next frame needs them, they begin as zeroes."""
        self._textures = {value: texture for value, texture in self._textures.items() if value[0] not in names}

    def swap(self, name: str) -> None:
        """End of frame: this frame's value becomes the last frame's."""
        _swap(self._textures, name)
        _swap(self._overwritten, name)

    # -- what there is -------------------------------------------------------------------------------------------------

    def texture(self, name: str, previous: bool = False) -> moderngl.Texture:
        """The texture of a target, or of its value in the last frame, filtered as the target wants it."""
        target = TARGETS[name]
        if (name, previous) not in self._textures:
            texture, new = self._pool.take(
                self._key(format_of(target)), self._used(), self.size, f"the target {name!r}"
            )
            if not new:
                self._clear(texture)
            self._textures[name, previous] = texture
        texture = self._textures[name, previous]
        if texture.filter != _FILTER[target.filter]:
            texture.filter = _FILTER[target.filter]
        return texture

    def holds(self, name: str) -> bool:
        """Whether a target has been written, or at least named, and not been dropped since."""
        return (name, False) in self._textures

    def buffer(self, name: str) -> moderngl.Buffer:
        """The storage block of that name."""
        if name not in self._buffers:
            self._buffers[name] = self._ctx.buffer(reserve=buffer_bytes(BUFFERS[name], self.size))
            check_made(self._ctx, self.size, BUFFERS[name].meaning)
        return self._buffers[name]

    def begin_buffer(self, name: str) -> None:
        """Zero a block's header (a dispatch header starts as 0, 1, 1 groups) before the frame's first use."""
        header = BUFFERS[name].header
        self.buffer(name).write(DISPATCH_HEADER * (header // 16) if BUFFERS[name].bytes_per_pixel else bytes(header))

    def framebuffer(self, names: tuple[str, ...]) -> moderngl.Framebuffer:
        """A cleared framebuffer over the given targets, with a depth attachment; depth reads SKY_DEPTH where nothing is
        drawn.
        """
        framebuffer = self._framebuffer([self.texture(name) for name in names], self._depth_test())
        framebuffer.clear()
        if "depth" in names:
            self._framebuffer([self.texture("depth")]).clear(SKY_DEPTH, 0.0, 0.0, 0.0)
        return framebuffer

    def clear(self, name: str) -> None:
        """Zero every texel of a target."""
        self._clear(self.texture(name))

    def read(self, name: str, previous: bool = False) -> np.ndarray:
        """Texels (height, width, components), bottom row first, in the target's own type. Waits for the GPU.

        Raises Overwritten if the frame has used the target's texture again.
        """
        if (name, previous) in self._overwritten:
            raise Overwritten(
                f"the target {name!r} is gone: its texture holds {self._overwritten[name, previous]!r} by now; "
                f"draw without sharing memory, or draw the view {name!r}"
            )
        texture = self.texture(name, previous)
        values = np.frombuffer(texture.read(alignment=1), _NUMPY[TARGETS[name].dtype])
        return values.reshape(texture.height, texture.width, texture.components)

    @property
    def bytes(self) -> dict[str, int]:
        """Bytes by target (several names where they share) or block, histories included."""
        names: dict[int, list[str]] = {}
        for (name, _), texture in self._textures.items():
            if name not in names.setdefault(texture.glo, []):
                names[texture.glo].append(name)
        usage: dict[str, int] = {}
        for texture in self._pool.textures:
            label = ", ".join(names.get(texture.glo, [IDLE]))
            usage[label] = usage.get(label, 0) + _bytes(texture)
        return usage | {name: buffer.size for name, buffer in self._buffers.items()}

    def release(self) -> None:
        self._pool.release_unused(())
        for buffer in self._buffers.values():
            buffer.release()
        self._textures, self._overwritten, self._buffers, self._idle_buffers = {}, {}, {}, {}

    # -- storage -------------------------------------------------------------------------------------------------------

    def _used(self) -> set[int]:
        return {texture.glo for texture in self._textures.values()}

    def _key(self, format: Format) -> Key:
        return texels(format, self.size), format.components, format.dtype

    def _missing(self, slots: Sequence[Slot], blocks: Collection[str]) -> int:
        """Bytes that a frame needs beyond what there is."""
        formats = [slot.format for slot in slots]
        formats += [format_of(TARGETS[name]) for name, _ in self._picked(slots) if self.holds(name)]
        missing, there = 0, {self._key(format): self._pool.count(self._key(format)) for format in formats}
        for format in formats:
            there[self._key(format)] -= 1
            missing += format_bytes(format, self.size) if there[self._key(format)] < 0 else 0
        return missing + sum(buffer_bytes(BUFFERS[b], self.size) for b in blocks if b not in self._buffers)

    def _picked(self, slots: Sequence[Slot]) -> tuple[Value, ...]:
        """What outlives a frame that does not draw it."""
        return () if any(PICKED in slot.names for slot in slots) else ((PICKED, False),)

    def _begin_buffers(self, blocks: Collection[str]) -> None:
        """Start a frame's blocks anew, and release those that have been unused for long."""
        for name in blocks:
            self.begin_buffer(name)
        for name in tuple(self._buffers):
            self._idle_buffers[name] = 0 if name in blocks else self._idle_buffers.get(name, 0) + 1
            if self._idle_buffers[name] > IDLE_FRAMES:
                self._buffers.pop(name).release()
                del self._idle_buffers[name]

    def _depth_test(self) -> moderngl.Texture:
        value = DEPTH_TEST.name, False
        if value not in self._textures:
            key = self._key(format_of(DEPTH_TEST))
            self._textures[value], _ = self._pool.take(key, self._used(), self.size, f"the {DEPTH_TEST.name}")
        return self._textures[value]

    def _framebuffer(
        self, colors: list[moderngl.Texture], depth: moderngl.Texture | None = None
    ) -> moderngl.Framebuffer:
        key = tuple(texture.glo for texture in (*colors, depth) if texture)
        if key not in self._framebuffers:
            self._framebuffers[key] = self._ctx.framebuffer(colors, depth)
        return self._framebuffers[key]

    def _clear(self, texture: moderngl.Texture) -> None:
        self._framebuffer([texture]).clear()

    def _forget_framebuffers(self, texture: moderngl.Texture) -> None:
        """Release those over a texture that is about to go."""
        for key in [key for key in self._framebuffers if texture.glo in key]:
            leave_framebuffers(self._ctx)
            self._framebuffers.pop(key).release()


def _left_by(slot: Slot, before: dict[Value, moderngl.Texture]) -> moderngl.Texture | None:
    """The texture in which the frame before left what a slot begins with."""
    first = slot.lives[0]
    return next((before[v] for v in first.values if v in before), None) if first.first == BEFORE else None


def _swap(held: dict[Value, Any], name: str) -> None:
    """Exchange what is held of a target's two values, of which either may be missing."""
    values = {previous: held.pop((name, not previous), None) for previous in (False, True)}
    held.update({(name, previous): value for previous, value in values.items() if value is not None})


def _bytes(texture: moderngl.Texture) -> int:
    """Of a texture, by what was asked for."""
    size = 4 if texture.depth else int(texture.dtype[1])
    return texture.width * texture.height * texture.components * size
