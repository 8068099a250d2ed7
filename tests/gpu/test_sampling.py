"""glsl/lib/sampling.glsl against app.sampling, bit for bit, and the properties both must have."""

from __future__ import annotations

import moderngl
import numpy as np
from scipy.stats import qmc

from app.sampling import hash_u32, owen_scramble, pixel_seed, r2, sobol4, sobol_directions

from .harness import call_glsl

rng = np.random.default_rng(1)


def test_hash_and_seed_are_bit_exact(ctx: moderngl.Context) -> None:
    x = rng.integers(0, 2**32, 4096, dtype=np.uint32)
    assert (call_glsl(ctx, "lib/sampling.glsl", "uint hash_u32(uint x)", x) == hash_u32(x)).all()
    pixels = rng.integers(0, 8192, (4096, 2), dtype=np.uint32)
    assert (
        call_glsl(ctx, "lib/sampling.glsl", "uint pixel_seed(uvec2 p, uint s)", pixels, 7)
        == pixel_seed(pixels[:, 0], pixels[:, 1], 7)
    ).all()


def test_sobol_is_bit_exact(ctx: moderngl.Context) -> None:
    index = np.concatenate([np.arange(4096), [65535, 2**31, 2**32 - 1]]).astype(np.uint32)
    seed = rng.integers(0, 2**32, len(index), dtype=np.uint32)
    assert (
        call_glsl(ctx, "lib/sampling.glsl", "vec4 sobol4(uint i, uint s)", index, seed)
        == sobol4(index, seed).astype(np.float32)
    ).all()


def test_directions_are_the_published_ones() -> None:
    ours = sobol_directions()
    points = qmc.Sobol(4, scramble=False, bits=32).random(256)
    index = np.arange(256) ^ (np.arange(256) >> 1)  # scipy walks in Gray-code order
    bits = np.zeros((256, 4), np.uint64)
    for b in range(8):
        bits ^= np.where((index >> b & 1)[:, None] != 0, ours[b].astype(np.uint64), 0)
    assert (bits / 2.0**32 == points).all()


def test_every_power_of_two_prefix_is_stratified() -> None:
    for log2n in (2, 4, 6, 8):
        n, side = 2**log2n, 2 ** (log2n // 2)
        points = sobol4(np.arange(n), np.full(n, 12345))
        cells = np.floor(points[:, :2] * side).astype(
            int
        )  # the lens pair is a (0, 2)-sequence; the pixel pair only stratifies per axis
        assert len(np.unique(cells[:, 0] * side + cells[:, 1])) == n
        for dimension in range(4):
            assert len(np.unique(np.floor(points[:, dimension] * n))) == n


def test_scramble_is_a_bijection_that_keeps_prefixes() -> None:
    x = np.arange(256, dtype=np.uint32) << 24
    y = owen_scramble(x, 99) >> 24
    assert len(np.unique(y)) == 256
    for bits in range(1, 8):  # equal leading digits stay equal
        groups = {}
        for a, b in zip(x >> np.uint32(32 - bits), y >> np.uint32(8 - bits), strict=True):
            assert groups.setdefault(int(a), int(b)) == int(b)


def test_r2_starts_at_the_centre_and_fills_the_pixel() -> None:
    assert r2(0) == (0.0, 0.0)
    points = np.array([r2(i) for i in range(4096)])
    assert abs(points).max() < 0.5 + 1e-12
    assert np.histogram2d(*points.T, bins=8, range=[[-0.5, 0.5]] * 2)[0].std() < 2.0
