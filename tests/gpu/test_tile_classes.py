"""Tile classes: every tile is in one list, that of its class, and classing changes no bit of the picture."""

from __future__ import annotations

import re

import moderngl
import numpy as np
import pytest

from app.frame.targets import TILE_CLASSES, TILE_PX
from app.gpu.shaders import load_glsl
from app.optics import IN_FOCUS_COC_PX
from app.scene.facts import Facts
from app.settings import Settings, put

from .post_rig import UNLIT, PostRig

RNG = np.random.default_rng(5)
SIZE = (200, 120)
SHARP, SLIGHT, NEAR, FAR, MIXED = range(TILE_CLASSES)


def class_of(reach: np.ndarray, begin: float) -> np.ndarray:
    """Twin of tile_class for (..., 2) extents."""
    near, far = -reach[..., 0], reach[..., 1]
    larger = np.maximum(near, far)
    kinds = np.where(far <= begin, NEAR, np.where(near <= begin, FAR, MIXED))
    return np.where(larger <= IN_FOCUS_COC_PX, SHARP, np.where(larger <= begin, SLIGHT, kinds))


def lists(rig: PostRig) -> list[np.ndarray]:
    """Each class' tiles (n, 2), x and y."""
    words = np.frombuffer(rig.targets.buffer("TileWork").read(), "<u4")
    heads, tiles = words[: 4 * TILE_CLASSES].reshape(-1, 4), words[4 * TILE_CLASSES :]
    room = int(np.prod([-(-side // TILE_PX) for side in SIZE]))
    found = []
    for index, (x, y, z, count) in enumerate(heads):
        assert (x, y, z) == (count, 1, 1)
        packed = tiles[index * room : index * room + count]
        found.append(np.stack([packed & 0xFFFF, packed >> 16], -1))
    return found


def islands() -> np.ndarray:
    """CoC radii (h, w) with quiet water between islands of near, far and slight blur."""
    coc = np.zeros((SIZE[1], SIZE[0]))
    for x, y, radius in ((20, 20, -9.0), (100, 90, 12.0), (170, 30, 1.5), (60, 60, 3.0), (75, 66, -3.0)):
        coc[y - 6 : y + 6, x - 6 : x + 6] = radius
    return coc


@pytest.mark.parametrize("slight", [True, False])
def test_every_tile_is_in_the_list_of_its_class(ctx: moderngl.Context, slight: bool) -> None:
    with PostRig(ctx, SIZE, put(UNLIT, "post.slight_focus", slight)) as rig:
        rig.run(RNG.random((SIZE[1], SIZE[0], 3)), islands())
        reach, found = rig.read("tiles_dilated"), lists(rig)
    expected = class_of(reach, 2.0 if slight else IN_FOCUS_COC_PX)
    assert len(np.unique(expected)) == (5 if slight else 4)
    seen = np.full(expected.shape, -1)
    for index, tiles in enumerate(found):
        assert len(tiles) == len(np.unique(tiles, axis=0))
        seen[tiles[:, 1], tiles[:, 0]] = index
    np.testing.assert_array_equal(seen, expected)
    assert sum(map(len, found)) == expected.size


def test_without_classes_all_tiles_are_mixed(ctx: moderngl.Context) -> None:
    with PostRig(ctx, SIZE, put(UNLIT, "post.tile_classes", False)) as rig:
        rig.run(RNG.random((SIZE[1], SIZE[0], 3)), islands())
        assert [len(tiles) for tiles in lists(rig)] == [0, 0, 0, 0, 13 * 8]


@pytest.mark.parametrize("slight", [True, False])
@pytest.mark.parametrize("coc", ["islands", "noise", "steps"])
def test_classes_change_no_bit_of_the_picture(ctx: moderngl.Context, coc: str, slight: bool) -> None:
    shape = SIZE[1], SIZE[0]
    circles = {
        "islands": islands(),
        "noise": RNG.uniform(-30.0, 30.0, shape) * (RNG.random(shape) < 0.01),
        "steps": np.repeat(np.linspace(-6.0, 6.0, 25), 8)[None, : SIZE[0]].repeat(SIZE[1], 0),
    }[coc]
    lit = np.exp2(RNG.uniform(-8.0, 8.0, (*shape, 3)))
    pictures = []
    for classes in (True, False):
        options = put(put(UNLIT, "post.slight_focus", slight), "post.tile_classes", classes)
        with PostRig(ctx, SIZE, options) as rig:
            pictures.append([rig.run(lit, circles, frame) for frame in range(3)])
    np.testing.assert_array_equal(*pictures)


def test_the_kernels_are_listed_as_the_shader_numbers_them() -> None:
    text = load_glsl()["dof/tile_classes.glsl"]
    numbers = {name: int(value) for name, value in re.findall(r"(?:const uint|#define) (\w+) =? ?(\d+)u?;?", text)}
    assert numbers == {
        "SHARP": SHARP,
        "SLIGHT": SLIGHT,
        "NEAR": NEAR,
        "FAR": FAR,
        "MIXED": MIXED,
        "CLASSES": TILE_CLASSES,
    }


BOUNDS = (0.0, IN_FOCUS_COC_PX, 1.9, 2.0, 2.1, 40.0)  # px: either side of where a path begins


@pytest.mark.parametrize("slight", [True, False])
@pytest.mark.parametrize("classes", [True, False])
@pytest.mark.parametrize("near_px", BOUNDS)
def test_what_cannot_be_is_left_out_and_the_picture_stays_the_same(
    ctx: moderngl.Context, near_px: float, classes: bool, slight: bool
) -> None:
    """Kernels, targets and passes of layers that no circle of confusion reaches."""
    options = put(put(Settings(), "post.slight_focus", slight), "post.tile_classes", classes)
    lit = RNG.random((SIZE[1], SIZE[0], 4))
    with PostRig(ctx, SIZE, options) as whole:
        for far_px in BOUNDS:
            if max(near_px, far_px) <= IN_FOCUS_COC_PX:
                continue  # no post-process at all
            circles = np.clip(islands() + RNG.uniform(-3.0, 3.0, SIZE[::-1]), -near_px, far_px)
            with PostRig(ctx, SIZE, options, facts=Facts(near_coc_px=near_px, far_coc_px=far_px)) as planned:
                np.testing.assert_array_equal(planned.run(lit, circles), whole.run(lit, circles))


def test_rounding_leaves_no_tile_undrawn(ctx: moderngl.Context) -> None:
    """A circle of confusion a little beyond what the facts allow: shown as if it were not."""
    circles, lit = np.full(SIZE[::-1], -np.nextafter(np.float32(2.0), np.float32(3.0))), np.ones((*SIZE[::-1], 3))
    circles[:, ::2] *= -1.0
    with PostRig(ctx, SIZE, facts=Facts(near_coc_px=2.0, far_coc_px=2.0)) as rig:
        np.testing.assert_allclose(rig.run(lit, circles)[..., :3], 1.0, atol=2.0**-10)
        assert sum(map(len, lists(rig))) == 13 * 8
