"""Textures that wait for whoever needs one alike: a plan that comes back finds its storage where it left it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field

import moderngl

from ..errors import UserError
from .memory import Size, check_made

IDLE_FRAMES = 60  # that a texture waits unused, about a second: who switches views back and forth allocates nothing

Key = tuple[Size, int, str]  # texels, components, dtype; of dtype "depth": for the depth test


@dataclass(eq=False)
class _Held:
    texture: moderngl.Texture
    idle: int = 0  # frames that began without it


@dataclass
class Pool:
    """Owns textures. Which of them are in use is told once a frame; the others are there to be taken."""

    ctx: moderngl.Context
    leaving: Callable[[moderngl.Texture], None]  # told of each texture before it is released
    _held: dict[Key, list[_Held]] = field(default_factory=dict)  # the oldest first

    def take(self, key: Key, used: Collection[int], size: Size, what: str) -> tuple[moderngl.Texture, bool]:
        """A texture that is not among the `used` (by their GL name), and whether it is new, and so all zeroes.

        Raises UserError, about a picture of `size`, if the driver has no memory for `what` it is to hold.
        """
        alike = self._held.setdefault(key, [])
        for held in alike:
            if held.texture.glo not in used:
                return held.texture, False
        alike.append(_Held(self._make(key, size, what)))
        return alike[-1].texture, True

    def count(self, key: Key) -> int:
        """How many there are, used or not."""
        return len(self._held.get(key, ()))

    @property
    def textures(self) -> list[moderngl.Texture]:
        """All of them."""
        return [held.texture for alike in self._held.values() for held in alike]

    def begin_frame(self, used: Collection[int]) -> None:
        """Release what has been unused for long."""
        for alike in self._held.values():
            for held in alike:
                held.idle = 0 if held.texture.glo in used else held.idle + 1
        self._release(lambda held: held.idle > IDLE_FRAMES)

    def release_unused(self, used: Collection[int]) -> None:
        """Release whatever is not in use now."""
        self._release(lambda held: held.texture.glo not in used)

    def _release(self, leaves: Callable[[_Held], bool]) -> None:
        for key, alike in self._held.items():
            leaving = [held for held in alike if leaves(held)]
            self._held[key] = [held for held in alike if held not in leaving]
            for held in leaving:
                self.leaving(held.texture)
                held.texture.release()

    def _make(self, key: Key, size: Size, what: str) -> moderngl.Texture:
        texels, components, dtype = key
        depth = dtype == "depth"
        texture = self.ctx.depth_texture(texels) if depth else self.ctx.texture(texels, components, dtype=dtype)
        try:
            check_made(self.ctx, size, what)
        except UserError:
            texture.release()
            raise
        if not depth:
            texture.repeat_x = texture.repeat_y = False
            texture.write(bytes(texels[0] * texels[1] * components * int(dtype[1])))
        return texture
