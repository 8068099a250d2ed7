"""Tiles, dilation and the half-resolution picture against numpy brute force."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.frame.targets import TILE_PX
from app.optics import IN_FOCUS_COC_PX

from . import post_twin as twin
from .post_rig import PostRig

LIMIT = 40.0
SIZES = [(160, 96), (157, 83), (16, 16), (17, 5), (1, 1)]


def blocks(coc: np.ndarray) -> np.ndarray:
    """(rows, columns, 256) CoC by tile, edges repeated."""
    h, w = coc.shape
    padded = np.pad(coc, ((0, -h % TILE_PX), (0, -w % TILE_PX)), mode="edge")
    rows, columns = padded.shape[0] // TILE_PX, padded.shape[1] // TILE_PX
    return padded.reshape(rows, TILE_PX, columns, TILE_PX).swapaxes(1, 2).reshape(rows, columns, -1)


def random_coc(size: tuple[int, int], seed: int) -> np.ndarray:
    """Mostly in focus, with blurred pixels of either sign, some beyond the limit."""
    rng = np.random.default_rng(seed)
    coc = rng.uniform(-0.5, 0.5, size[::-1])
    odd = rng.random(size[::-1]) < 0.002
    coc[odd] = rng.uniform(-60, 60, odd.sum())
    return coc.astype(np.float32)


def brute_dilation(tiles: np.ndarray) -> np.ndarray:
    """Every tile looks at every other, in two dimensions."""
    rows, columns, _ = tiles.shape
    result = tiles.copy()
    for y in range(rows):
        for x in range(columns):
            distance = np.maximum(np.abs(np.arange(rows)[:, None] - y), np.abs(np.arange(columns)[None] - x))
            near = tiles[..., 0][twin.tile_reach(-tiles[..., 0]) >= distance]
            far = tiles[..., 1][twin.tile_reach(tiles[..., 1]) >= distance]
            result[y, x] = min(tiles[y, x, 0], near.min(initial=np.inf)), max(tiles[y, x, 1], far.max(initial=-np.inf))
    return result


@pytest.mark.parametrize("size", SIZES)
def test_tiles_and_dilation_are_exact(ctx: moderngl.Context, size: tuple[int, int]) -> None:
    for seed in range(3):
        coc = random_coc(size, seed)
        with PostRig(ctx, size, max_coc_px=LIMIT) as rig:
            rig.run(np.zeros((*coc.shape, 3)), coc)
            tiles, dilated = rig.read("tiles"), rig.read("tiles_dilated")
        by_tile = blocks(np.clip(coc, -LIMIT, LIMIT))
        assert (tiles == np.stack([by_tile.min(-1), by_tile.max(-1)], -1)).all()
        assert (dilated == brute_dilation(tiles)).all()


def test_every_pixel_that_a_splat_touches_has_been_told(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(9)
    for _ in range(12):
        x, y = rng.integers(0, (160, 96))
        radius = float(rng.uniform(IN_FOCUS_COC_PX + 0.01, LIMIT))
        coc = np.zeros((96, 160), np.float32)
        coc[y, x] = -radius
        with PostRig(ctx, (160, 96), max_coc_px=LIMIT) as rig:
            rig.run(np.zeros((96, 160, 3)), coc)
            told = rig.read("tiles_dilated")[..., 0] <= -radius + 1e-5
        ys, xs = np.mgrid[:96, :160]
        touched = np.hypot(xs - x, ys - y) <= radius + 1.0
        assert told[ys[touched] // TILE_PX, xs[touched] // TILE_PX].all()


def test_a_block_stands_for_one_surface_and_for_every_pixel_in_turn(ctx: moderngl.Context) -> None:
    coc = np.tile(np.array([[-10.0, 0.0], [10.0, 20.0]], np.float32), (8, 8))
    lit = np.repeat(np.abs(coc)[..., None], 3, -1)
    seen = []
    with PostRig(ctx, (16, 16)) as rig:
        for frame in range(4):
            rig.run(lit, coc, frame)
            half = rig.read("half_color")
            assert (half[..., 0] == np.abs(half[..., 3])).all()
            assert (half == half[0, 0]).all()
            seen.append(float(half[0, 0, 3]))
    assert sorted(seen) == [-10.0, 0.0, 10.0, 20.0]


def test_a_block_of_one_surface_is_its_mean(ctx: moderngl.Context) -> None:
    lit = np.random.default_rng(2).random((32, 48, 3)).astype(np.float16)
    with PostRig(ctx, (48, 32)) as rig:
        rig.run(lit, np.full((32, 48), 5.0))
        half = rig.read("half_color")[..., :3]
    mean = lit.astype(float).reshape(16, 2, 24, 2, 3).mean((1, 3))
    assert np.abs(half - mean).max() <= 2.0**-11  # one rounding to float16 below 1, in either direction
