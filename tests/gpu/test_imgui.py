"""The ImGui renderer: textures on request, user textures, scissors, high density, no scissor left behind."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import moderngl
import numpy as np
import pytest
from imgui_bundle import imgui

from app.gpu.imgui import ImguiRenderer

SIZE = (64, 48)  # window units
BARE = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_background | imgui.WindowFlags_.no_saved_settings
Paint = Callable[[ImguiRenderer], None]


@pytest.fixture
def renderer(ctx: moderngl.Context) -> Iterator[ImguiRenderer]:
    imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.delta_time = 1 / 60
    made = ImguiRenderer(ctx)
    yield made
    made.release()
    imgui.destroy_context()


def picture(
    ctx: moderngl.Context, renderer: ImguiRenderer, paint: Paint, scale: int = 1, frames: int = 1
) -> np.ndarray:
    """(h, w, 3) uint8, top row first, of what `paint` draws on black."""
    io = imgui.get_io()
    io.display_size, io.display_framebuffer_scale = imgui.ImVec2(*SIZE), imgui.ImVec2(scale, scale)
    target = framebuffer(ctx, (SIZE[0] * scale, SIZE[1] * scale))
    for _ in range(frames):
        imgui.new_frame()
        paint(renderer)
        imgui.render()
        target.use()
        target.clear()
        renderer.render(imgui.get_draw_data())
    return np.frombuffer(target.read(alignment=1), np.uint8).reshape(SIZE[1] * scale, SIZE[0] * scale, 3)[::-1]


@cache
def framebuffer(ctx: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
    """Kept for good: moderngl binds the last one again whenever it makes another, which is an error once it is gone."""
    return ctx.simple_framebuffer(size)


def rectangle(renderer: ImguiRenderer) -> None:
    drawing = imgui.get_background_draw_list()
    color = imgui.color_convert_float4_to_u32(imgui.ImVec4(1.0, 0.5, 0.0, 1.0))
    drawing.add_rect_filled(imgui.ImVec2(8, 4), imgui.ImVec2(40, 20), color)


@pytest.mark.parametrize("scale", [1, 2, 3])
def test_shapes_land_where_they_were_asked_for_at_any_density(
    ctx: moderngl.Context, renderer: ImguiRenderer, scale: int
) -> None:
    pixels = picture(ctx, renderer, rectangle, scale)
    rows, columns = np.nonzero(pixels.any(-1))
    assert (rows.min(), rows.max() + 1) == (4 * scale, 20 * scale)
    assert (columns.min(), columns.max() + 1) == (8 * scale, 40 * scale)
    assert tuple(pixels[10 * scale, 20 * scale]) == (255, 128, 0)


def test_scissors_cut(ctx: moderngl.Context, renderer: ImguiRenderer) -> None:
    def clipped(renderer: ImguiRenderer) -> None:
        drawing = imgui.get_background_draw_list()
        drawing.push_clip_rect(imgui.ImVec2(16, 8), imgui.ImVec2(24, 12))
        rectangle(renderer)
        drawing.pop_clip_rect()

    rows, columns = np.nonzero(picture(ctx, renderer, clipped, 2).any(-1))
    assert (rows.min(), rows.max() + 1, columns.min(), columns.max() + 1) == (16, 24, 32, 48)
    assert not picture(ctx, renderer, lambda _: None).any()  # and nothing stays cut or drawn


def test_text_appears_and_new_glyphs_update_the_atlas(ctx: moderngl.Context, renderer: ImguiRenderer) -> None:
    def words(text: str) -> Paint:
        white = imgui.color_convert_float4_to_u32(imgui.ImVec4(1.0, 1.0, 1.0, 1.0))
        return lambda _: imgui.get_background_draw_list().add_text(imgui.ImVec2(2, 2), white, text)

    first = picture(ctx, renderer, words("abc"), frames=2)
    second = picture(ctx, renderer, words("XYZ%&"), frames=2)  # glyphs that the atlas did not hold yet
    assert first.any()
    assert second.any()
    assert (first != second).any()


def test_more_than_was_reserved_is_drawn_whole(ctx: moderngl.Context, renderer: ImguiRenderer) -> None:
    """20 000 rectangles have more vertices than the first buffers hold; the last of them must still arrive."""

    def many(_: ImguiRenderer) -> None:
        drawing = imgui.get_background_draw_list()
        for i in range(20000):
            color = imgui.color_convert_float4_to_u32(
                imgui.ImVec4(0.0, 1.0, 0.0, 1.0) if i == 19999 else imgui.ImVec4(1.0, 0.0, 0.0, 1.0)
            )
            drawing.add_rect_filled(imgui.ImVec2(0, 0), imgui.ImVec2(*SIZE), color)

    assert (picture(ctx, renderer, many) == (0, 255, 0)).all()
