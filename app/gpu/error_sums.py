"""Compares pictures with a true one on the GPU: sums of squared errors by region, read a few frames late, and a map.

Outside any frame's plan: it costs nothing until it is asked for.
"""

from __future__ import annotations

import math

import moderngl
import numpy as np
from numpy.typing import NDArray

from .programs import Program, Programs, give
from .timing import RING

BLOCK = 16  # px: a side of what one invocation adds up
GROUP = 8  # invocations per side of a work group


class ErrorSums:
    """One true picture, and the pictures that are compared with it."""

    def __init__(self, ctx: moderngl.Context, programs: Programs, regions: int) -> None:
        self._ctx, self._programs, self._regions = ctx, programs, regions
        self._storage: list[moderngl.Texture | moderngl.Buffer] = []
        self._frame, self.size = 0, (0, 0)

    def set_truth(self, picture: NDArray[np.floating], labels: NDArray[np.uint8]) -> None:
        """Compare with a linear picture (h, w, 3) whose pixels (h, w) are in these regions, top row first.

        What was queued is forgotten.
        """
        self._drop()
        height, width = labels.shape
        self.size = width, height
        texels = np.dstack([picture, labels]).astype(np.float32)
        self._truth = self._ctx.texture(self.size, 4, np.ascontiguousarray(texels[::-1]), dtype="f4")
        columns, rows = -(-width // BLOCK), -(-height // BLOCK) * self._regions
        self._sums = self._ctx.texture((columns, rows), 4, dtype="f4")
        self._rows = self._ctx.texture((1, rows), 4, dtype="f4")
        self._painted = self._ctx.texture(self.size, 4, dtype="f1")
        self._ring = [self._ctx.buffer(reserve=rows * 16) for _ in range(RING)]
        self._storage = [self._truth, self._sums, self._rows, self._painted, *self._ring]

    def queue(self, picture: moderngl.Texture) -> None:
        """Sum up the errors of a linear picture, bottom row first, of the truth's size. Waits for nothing."""
        blocks, row_sums = self._program("measure/block_sums.comp"), self._program("measure/row_sums.comp")
        self._bind(blocks, in_picture=picture, in_truth=self._truth, out_sums=self._sums)
        groups = (math.ceil(n / GROUP) for n in (self._sums.width, self._sums.height // self._regions))
        blocks.run(*groups)
        self._ctx.memory_barrier()
        self._bind(row_sums, in_sums=self._sums, out_rows=self._rows)
        row_sums.run(1, math.ceil(self._rows.height / 64))
        self._ctx.memory_barrier()
        self._rows.read_into(self._ring[self._frame % RING])
        self._frame += 1

    def sums(self, age: int = RING - 1) -> NDArray[np.float64] | None:
        """(regions, 4) of the picture queued `age` pictures before the last: squared, relative and displayed squared
        errors, summed, and the number of pixels. None if there were not so many. Age 0 waits for the GPU.
        """
        if not 0 <= age < min(self._frame, RING):
            return None
        values = np.frombuffer(self._ring[(self._frame - 1 - age) % RING].read(), np.float32)
        return values.reshape(self._regions, -1, 4).sum(1, dtype=np.float64)

    def sums_of(self, picture: NDArray[np.floating]) -> NDArray[np.float64]:
        """(regions, 4) of a linear picture (h, w, 3), top row first. Waits for it; what was queued is forgotten."""
        texels = np.dstack([picture, np.ones(picture.shape[:2])]).astype(np.float32)
        uploaded = self._ctx.texture(self.size, 4, np.ascontiguousarray(texels[::-1]), dtype="f4")
        self._frame = 0
        self.queue(uploaded)
        found = self.sums(age=0)
        self._frame = 0
        uploaded.release()
        assert found is not None
        return found

    def paint(self, picture: moderngl.Texture, low: float, high: float) -> moderngl.Texture:
        """Display values, bottom row first, of the displayed difference at each pixel; colours from `low` to `high`."""
        heat = self._program("measure/heat.comp")
        self._bind(heat, in_picture=picture, in_truth=self._truth, out_display=self._painted)
        give(heat, range=(low, high))
        heat.run(*(math.ceil(n / GROUP) for n in self.size))
        self._ctx.memory_barrier()
        return self._painted

    def forget(self) -> None:
        """Have no true picture any more."""
        self._drop()

    def release(self) -> None:
        self._drop()

    def _program(self, name: str) -> Program:
        defines = {"REGIONS": self._regions, "BLOCK": BLOCK}
        return self._programs.get(name, defines.items()).program

    def _bind(self, program: Program, **textures: moderngl.Texture) -> None:
        """Samplers and the one image by name, as a plan's passes have them."""
        for unit, (name, texture) in enumerate(textures.items()):
            if name.startswith("out_"):
                texture.bind_to_image(0, read=False, write=True)
                give(program, **{name: 0})
            else:
                texture.use(unit)
                give(program, **{name: unit})

    def _drop(self) -> None:
        for resource in self._storage:
            resource.release()
        self._storage, self._frame, self.size = [], 0, (0, 0)
