"""Puts finished pictures on the window: one, or two on either side of a bar."""

from __future__ import annotations

import moderngl

from .programs import Programs

Rect = tuple[int, int, int, int]  # x, y from the bottom left, width, height; framebuffer px


class Presenter:
    """Draws `display` textures into a rectangle of a framebuffer."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = Programs(ctx).get("output/compare", ()).program
        self._program["left"], self._program["right"] = 0, 1
        self._triangle = ctx.vertex_array(self._program, [])
        self._sampler = ctx.sampler(repeat_x=False, repeat_y=False, filter=(moderngl.LINEAR, moderngl.LINEAR))

    def show(
        self,
        left: moderngl.Texture,
        right: moderngl.Texture | None,
        bar: float,
        rect: Rect,
        target: moderngl.Framebuffer,
    ) -> None:
        """Fill `rect` of `target` with `left`, and `right` beyond the fraction `bar` of its width if there is one."""
        if rect[2] < 1 or rect[3] < 1:
            return
        target.use()
        target.viewport = rect
        self._ctx.enable_only(moderngl.NOTHING)
        left.use(0)
        (right or left).use(1)
        self._sampler.use(0)
        self._sampler.use(1)
        self._program["bar_x"] = bar if right else -1.0
        self._program["texel"] = 1.0 / rect[2]
        self._triangle.render(moderngl.TRIANGLES, vertices=3)
        self._sampler.clear(0)
        self._sampler.clear(1)

    def release(self) -> None:
        for resource in (self._triangle, self._program, self._sampler):
            resource.release()
