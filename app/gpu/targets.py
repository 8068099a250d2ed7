"""The textures and storage blocks behind the tables of app.frame.targets: made on first use, owned here, released
here.
"""

from __future__ import annotations

from collections.abc import Collection

import moderngl
import numpy as np

from ..errors import UserError
from ..frame.records import Target
from ..frame.targets import BUFFERS, TARGETS
from ..optics import SKY_DEPTH
from .context import leave_framebuffers
from .memory import buffer_bytes, check_frame, check_made, texels, texture_bytes

_NUMPY = {"f1": np.uint8, "f2": np.float16, "f4": np.float32}
_FILTER = {"nearest": (moderngl.NEAREST, moderngl.NEAREST), "linear": (moderngl.LINEAR, moderngl.LINEAR)}

DEPTH_TEST = "depth test"  # the one texture that is no target
DISPATCH_HEADER = np.array([0, 1, 1, 0], "<u4").tobytes()  # no groups yet in x, one in y and z; no items


class Targets:
    """All per-size GPU storage of one renderer. Sizes are (width, height) in full-resolution px."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        self._ctx = ctx
        self._textures: dict[tuple[str, bool], moderngl.Texture] = {}
        self._buffers: dict[str, moderngl.Buffer] = {}
        self._framebuffers: dict[tuple[str, ...], moderngl.Framebuffer] = {}
        self._clearers: dict[int, moderngl.Framebuffer] = {}  # by their one texture: two for a target with a history
        self._depth: moderngl.Texture | None = None
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

    def reserve(self, names: Collection[str]) -> None:
        """Raise UserError if the targets of that name do not fit into memory, before the first of them is made."""
        held = sum(count for name, count in self.bytes.items() if name in names or name == DEPTH_TEST)
        check_frame(self._ctx, [TARGETS[name] for name in names], self.size, held)

    def texture(self, name: str, previous: bool = False) -> moderngl.Texture:
        """The texture of a target, or of its value in the last frame."""
        key = (name, previous)
        if key not in self._textures:
            self._textures[key] = self._make(TARGETS[name])
        return self._textures[key]

    def swap(self, name: str) -> None:
        """End of frame: this frame's value becomes the last frame's."""
        current, previous = self.texture(name), self.texture(name, previous=True)
        self._textures[name, False], self._textures[name, True] = previous, current

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
        if names not in self._framebuffers:
            if self._depth is None:
                self._depth = self._ctx.depth_texture(self.size)
                check_made(self._ctx, self.size, f"the {DEPTH_TEST}")
            self._framebuffers[names] = self._ctx.framebuffer([self.texture(n) for n in names], self._depth)
            if "depth" in names:
                self._framebuffers["depth",] = self._ctx.framebuffer([self.texture("depth")])
        self._framebuffers[names].clear()
        if "depth" in names:
            self._framebuffers["depth",].clear(SKY_DEPTH, 0.0, 0.0, 0.0)
        return self._framebuffers[names]

    def clear(self, name: str, previous: bool = False) -> None:
        """Zero every texel of a target, or of its value in the last frame."""
        texture = self.texture(name, previous)
        if texture.glo not in self._clearers:
            self._clearers[texture.glo] = self._ctx.framebuffer([texture])
        self._clearers[texture.glo].clear()

    def read(self, name: str, previous: bool = False) -> np.ndarray:
        """Texels (height, width, components), bottom row first, in the target's own type. Waits for the GPU."""
        texture = self.texture(name, previous)
        values = np.frombuffer(texture.read(alignment=1), _NUMPY[TARGETS[name].dtype])
        return values.reshape(texture.height, texture.width, texture.components)

    @property
    def bytes(self) -> dict[str, int]:
        """Bytes by target or block name, histories included."""
        usage: dict[str, int] = {}
        for name, _ in self._textures:
            usage[name] = usage.get(name, 0) + texture_bytes(TARGETS[name], self.size)
        usage |= {name: buffer.size for name, buffer in self._buffers.items()}
        if self._depth is not None:
            usage[DEPTH_TEST] = self._depth.width * self._depth.height * 4
        return usage

    def release(self) -> None:
        leave_framebuffers(self._ctx)
        framebuffers = (*self._framebuffers.values(), *self._clearers.values())
        for resource in (*framebuffers, *self._textures.values(), *self._buffers.values(), self._depth):
            if resource is not None:
                resource.release()
        self._framebuffers, self._clearers, self._textures, self._buffers, self._depth = {}, {}, {}, {}, None

    def _make(self, target: Target) -> moderngl.Texture:
        texture = self._ctx.texture(texels(target, self.size), target.components, dtype=target.dtype)
        try:
            check_made(self._ctx, self.size, f"the target {target.name!r}")
        except UserError:
            texture.release()
            raise
        texture.repeat_x = texture.repeat_y = False
        texture.filter = _FILTER[target.filter]
        texture.write(bytes(texture_bytes(target, self.size)))
        return texture
