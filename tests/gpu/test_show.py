"""The target viewer's shader: every kind of target against the twins of its colour maps, and no bad value hidden."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.frame.output import SHOW_KINDS
from app.gpu.layout import FRAME
from app.gpu.shaders import assemble, load_glsl
from app.panel.colormap import diverging, sequential, signed_unit, wheel

LOW, HIGH = -4.0, 8.0
MAGENTA = (255, 0, 255)
BYTE = 1.0  # of 255: the image rounds, and the colour maps' sine and cosine are good to a fraction of it


def shown(ctx: moderngl.Context, kind: str, texels: np.ndarray, size: tuple[int, int] | None = None) -> np.ndarray:
    """(h, w, 3) uint8 that show.comp paints of float32 texels (h, w, c), bottom row first."""
    height, width, components = texels.shape
    size = size or (width, height)
    frame = np.zeros((), FRAME)
    frame["overlay_range_lo"], frame["overlay_range_hi"], frame["exposure"], frame["size_px"] = LOW, HIGH, 1.0, size
    block = ctx.buffer(frame.tobytes())
    source = ctx.texture((width, height), components, np.ascontiguousarray(texels, np.float32).tobytes(), dtype="f4")
    display = ctx.texture(size, 4)
    shader = ctx.compute_shader(assemble("output/show.comp", load_glsl(), {"SHOW": SHOW_KINDS.index(kind)}).text)
    if "FrameBlock" in shader:
        shader["FrameBlock"].binding = 0  # type: ignore[union-attr]
        block.bind_to_uniform_block(0)
    source.use(0)
    display.bind_to_image(0, read=False, write=True)
    shader["in_color"], shader["out_display"] = 0, 0
    shader.run(-(-size[0] // 8), -(-size[1] // 8))
    ctx.memory_barrier()
    pixels = np.frombuffer(display.read(), np.uint8).reshape(size[1], size[0], 4)
    for resource in (block, source, display, shader):
        resource.release()
    assert (pixels[..., 3] == 255).all()
    return pixels[..., :3]


def close(pixels: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(pixels.astype(float), 255.0 * expected, atol=BYTE)


VALUES = np.linspace(-6.0, 12.0, 13 * 21).reshape(13, 21)  # beyond both ends


def test_scalars_run_from_end_to_end(ctx: moderngl.Context) -> None:
    close(shown(ctx, "scalar", VALUES[..., None]), sequential((VALUES - LOW) / (HIGH - LOW)))


def test_signed_values_have_zero_in_the_middle_whatever_the_range(ctx: moderngl.Context) -> None:
    close(shown(ctx, "signed", VALUES[..., None]), diverging(signed_unit(VALUES, LOW, HIGH)))


def test_of_a_tiles_extremes_the_farther_from_zero_is_shown(ctx: moderngl.Context) -> None:
    extremes = np.stack([np.minimum(VALUES, 0.0) - 1.0, np.maximum(VALUES, 0.0)], -1)
    farther = np.where(np.abs(extremes[..., 0]) >= extremes[..., 1], extremes[..., 0], extremes[..., 1])
    close(shown(ctx, "signed", extremes), diverging(signed_unit(farther, LOW, HIGH)))


def test_vectors_show_direction_and_length(ctx: moderngl.Context) -> None:
    angle, length = np.meshgrid(np.linspace(-3.0, 3.0, 31), np.linspace(0.0, 10.0, 11))
    x, y = length * np.cos(angle), length * np.sin(angle)
    close(shown(ctx, "vector", np.stack([x, y], -1)), wheel(x / HIGH, y / HIGH))


def test_normals_are_decoded_and_the_sky_is_black(ctx: moderngl.Context) -> None:
    texels = np.zeros((1, 4, 4))
    texels[0, :3, 3] = 1.0
    texels[0, 0, :2], texels[0, 1, :2] = (1.0, 0.0), (0.0, 1.0)  # octahedral: +x, +y; then +z; then sky
    pixels = shown(ctx, "normal", texels)[0]
    close(pixels, np.array([(1, 0.5, 0.5), (0.5, 1, 0.5), (0.5, 0.5, 1), (0, 0, 0)]))


def test_colours_are_srgb(ctx: moderngl.Context) -> None:
    linear = np.linspace(-0.5, 2.0, 64).reshape(1, 64, 1) * np.ones(3)
    clipped = np.clip(linear, 0.0, 1.0)
    srgb = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    close(shown(ctx, "color", np.concatenate([linear, np.ones((1, 64, 1))], -1)), srgb)


@pytest.mark.parametrize("kind", SHOW_KINDS)
def test_what_is_no_number_is_magenta_in_every_kind(ctx: moderngl.Context, kind: str) -> None:
    texels = np.full((1, 4, 4), 0.5)
    texels[0, 0, 0], texels[0, 1, 0], texels[0, 2, 3] = np.nan, np.inf, -np.inf
    pixels = shown(ctx, kind, texels)[0]
    assert [tuple(p) == MAGENTA for p in pixels] == [True, True, True, False]


def test_texels_of_a_coarse_target_are_blocks(ctx: moderngl.Context) -> None:
    coarse = np.arange(6.0).reshape(2, 3, 1)
    fine = shown(ctx, "scalar", coarse, size=(48, 32))
    np.testing.assert_array_equal(fine, np.kron(shown(ctx, "scalar", coarse), np.ones((16, 16, 1), np.uint8)))
