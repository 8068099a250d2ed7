"""Procedural textures for the built-in scenes, as uint8 pixels; tileable unless said otherwise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Pixels = NDArray[np.uint8]


def to_bytes(values: F64, levels: int = 64) -> Pixels:
    """[0, 1] to 8 bit in `levels` steps: fewer steps than 256 look the same on noise and halve the file."""
    steps = np.round(np.clip(values, 0.0, 1.0) * (levels - 1)) / (levels - 1)
    return np.round(steps * 255.0).astype(np.uint8)


def coordinates(height: int, width: int) -> tuple[F64, F64]:
    """(u, v) at the texel centres, each (h, w)."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return u, v


def noise(u: F64, v: F64, cells_u: int, cells_v: int, seed: int) -> F64:
    """Tileable value noise in [0, 1] with smooth interpolation between lattice values."""
    lattice = np.random.Generator(np.random.PCG64(seed)).random((cells_v, cells_u))
    x, y = u * cells_u, v * cells_v
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (f * f * (3 - 2 * f) for f in (x - i, y - j))
    i0, i1, j0, j1 = i % cells_u, (i + 1) % cells_u, j % cells_v, (j + 1) % cells_v
    top = lattice[j0, i0] * (1 - fx) + lattice[j0, i1] * fx
    bottom = lattice[j1, i0] * (1 - fx) + lattice[j1, i1] * fx
    return top * (1 - fy) + bottom * fy


def smoothstep(low: float, high: float, x: F64) -> F64:
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def mix(a: tuple[float, ...] | F64, b: tuple[float, ...] | F64, t: F64) -> F64:
    """Blend of two colours by a (h, w) weight."""
    return np.asarray(a) * (1 - t[..., None]) + np.asarray(b) * t[..., None]


def normal_map(height: F64, depth: float) -> Pixels:
    """Tangent-space normals (+y up the texture) of a tileable height field with a range of `depth` texture widths."""
    size = height.shape[1]
    du = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * size * depth / 2
    dv = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) * size * depth / 2
    n = np.stack([-du, dv, np.ones_like(height)], -1)
    return to_bytes(n / np.linalg.norm(n, axis=-1, keepdims=True) * 0.5 + 0.5, 256)


def wood(size: int, planks: int, seed: int) -> Pixels:
    """Boards side by side, grain along v."""
    u, v = coordinates(size, size)
    board = np.floor(u * planks)
    shade = np.random.Generator(np.random.PCG64(seed)).random(planks)[board.astype(int)]
    wobble = noise(u, v, 8 * planks, 4, seed + 1)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (u * planks * 9 + 2.5 * wobble + 7 * shade))
    grain = 0.55 * rings + 0.45 * noise(u, v, 128, 8, seed + 2)
    color = mix((0.33, 0.19, 0.10), (0.62, 0.41, 0.24), np.clip(grain * 0.7 + 0.4 * (shade - 0.4), 0, 1))
    edge = np.abs(u * planks - board - 0.5) * 2
    return to_bytes(color * (1 - 0.65 * smoothstep(0.96, 0.995, edge))[..., None], 48)


def wallpaper(size: int) -> Pixels:
    """Stripes with rows of diamonds and dots: clear edges at several sizes, which make blur visible."""
    u, v = coordinates(size, size)
    stripe = smoothstep(-0.04, 0.04, np.sin(2 * np.pi * 2 * u))
    color = mix((0.27, 0.36, 0.40), (0.36, 0.46, 0.48), stripe)
    diamond = np.abs((2 * u) % 1 - 0.5) * 1.6 + np.abs((2 * v) % 1 - 0.5)
    color = mix(color, np.broadcast_to((0.78, 0.70, 0.50), color.shape), 1 - smoothstep(0.30, 0.32, diamond))
    color = mix(color, np.broadcast_to((0.50, 0.20, 0.16), color.shape), 1 - smoothstep(0.14, 0.16, diamond))
    dots = np.hypot((8 * u) % 1 - 0.5, (8 * v) % 1 - 0.5)
    return to_bytes(mix(color, color * 0.7, 1 - smoothstep(0.10, 0.14, dots)), 64)


def checkerboard(size: int) -> Pixels:
    """An 8 x 8 chessboard inside a dark border; not tileable."""
    u, v = coordinates(size, size)
    x, y = (u - 0.06) / 0.88 * 8, (v - 0.06) / 0.88 * 8
    inside = (x > 0) & (x < 8) & (y > 0) & (y < 8)
    odd = (np.floor(x) + np.floor(y)) % 2 == 1
    grain = 0.88 + 0.12 * noise(u, v, 64, 8, 11)
    color = np.where(odd[..., None], (0.20, 0.11, 0.07), (0.80, 0.68, 0.48))
    return to_bytes(np.where(inside[..., None], color, (0.13, 0.07, 0.05)) * grain[..., None], 64)


def vase(size: int) -> tuple[Pixels, Pixels, Pixels]:
    """(colour, metallic-roughness, normals) of a glazed vase: blue scales, gilded bands, a matt foot."""
    u, v = coordinates(size, size)
    x, y = u * 12, v * 16
    row = np.floor(y)
    center = np.hypot((x + 0.5 * (row % 2)) % 1 - 0.5, (y - row) - 0.15)
    scale = smoothstep(0.30, 0.62, center)
    glaze = mix((0.10, 0.27, 0.45), (0.82, 0.86, 0.84), scale)
    gold = sum(np.exp(-(((v - at) / 0.012) ** 4)) for at in (0.16, 0.45, 0.78))
    matt = smoothstep(0.90, 0.91, v)
    color = mix(glaze, np.broadcast_to((0.95, 0.74, 0.36), glaze.shape), gold)
    color = mix(color, np.broadcast_to((0.52, 0.33, 0.22), glaze.shape), matt)
    rough = 0.14 + 0.12 * scale + 0.10 * gold + 0.7 * matt
    surface = np.stack([np.zeros_like(u), rough, gold * (1 - matt)], -1)
    relief = (1 - scale) * (1 - gold) * (1 - matt) + 0.9 * gold
    return to_bytes(color), to_bytes(surface), normal_map(relief, 0.006)


def citrus(size: int) -> tuple[Pixels, Pixels]:
    """(colour, normals) of orange peel."""
    u, v = coordinates(size, size)
    pores = smoothstep(0.55, 0.85, noise(u, v, 48, 32, 21))
    color = mix((0.93, 0.48, 0.08), (0.80, 0.33, 0.04), 0.5 * pores + 0.5 * noise(u, v, 6, 4, 22))
    return to_bytes(color), normal_map(1 - pores, 0.006)


def leaf(size: int) -> Pixels:
    """RGBA: one serrated leaf with midrib and veins, stalk at the bottom; outside it alpha is 0. Not tileable."""
    u, v = coordinates(size, size)
    along = 1 - v  # from the stalk to the tip
    blade = np.clip((along - 0.12) / 0.86, 0.0, 1.0)
    half = 0.44 * np.sin(np.pi * blade**0.8) ** 0.9 * (1 - 0.25 * blade)
    teeth = 0.045 * np.abs(((blade * 13) % 1) - 0.3) * np.sin(np.pi * blade)
    across = np.abs(u - 0.5)
    inside = smoothstep(-0.008, 0.008, half - teeth - across) * ((along > 0.12) & (along < 0.98))
    stalk = 1 - smoothstep(0.012, 0.020, across + 0.5 * np.clip(along - 0.2, 0, 1))
    veins = np.exp(-((np.abs(((blade - 0.9 * across) * 9) % 1 - 0.5) / 0.06) ** 2))
    rib = np.exp(-((across / 0.012) ** 2))
    color = mix((0.16, 0.36, 0.08), (0.30, 0.50, 0.14), noise(u, v, 9, 9, 31))
    color = mix(color, np.broadcast_to((0.50, 0.62, 0.26), color.shape), np.clip(0.45 * veins + 0.9 * rib, 0, 1))
    return np.dstack([to_bytes(color), to_bytes(np.maximum(inside, stalk), 256)])


def stripes(size: int, count: int, dark: tuple[float, ...], light: tuple[float, ...]) -> Pixels:
    """Slanting stripes of two colours, with dots on the light ones."""
    u, v = coordinates(size, size)
    phase = (count * (u + v)) % 1.0
    band = smoothstep(0.23, 0.27, np.abs(phase - 0.5))
    dots = 1 - smoothstep(0.07, 0.09, np.hypot((2 * count * u) % 1 - 0.5, (2 * count * v) % 1 - 0.5) / 2)
    color = mix(light, dark, band)
    return to_bytes(mix(color, color * 0.45, dots * (1 - band)), 64)


def facade(size: int, wall: tuple[float, ...], seed: int) -> tuple[Pixels, Pixels]:
    """(colour, emission) of a storey of timbered wall with two windows, one of them lit."""
    u, v = coordinates(size, size)
    plaster = np.asarray(wall) * (0.85 + 0.3 * noise(u, v, 12, 12, seed))[..., None]
    beam = np.maximum.reduce([np.abs(u - 0.5) > 0.47, np.abs(v - 0.5) > 0.46, np.abs(u - 0.5) < 0.025])
    brace = (np.abs(np.abs(u - 0.5) - 0.47 + 0.30 * (1 - v)) < 0.022) & (v > 0.62)
    color = np.where((beam | brace)[..., None], (0.20, 0.11, 0.07), plaster)
    x, y = (2 * u) % 1 - 0.5, v - 0.40
    frame = (np.abs(x) < 0.30) & (np.abs(y) < 0.24)
    pane = (np.abs(x) < 0.25) & (np.abs(y) < 0.20) & (np.abs(x) > 0.02) & (np.abs(y + 0.05) > 0.012)
    color = np.where(frame[..., None], (0.88, 0.84, 0.74), color)
    color = np.where(pane[..., None], (0.10, 0.13, 0.18), color)
    lit = (pane & ((u < 0.5) == bool(seed % 2))).astype(float)
    return to_bytes(color, 48), to_bytes(lit[..., None] * np.array([1.0, 0.72, 0.36]), 16)


def roof_tiles(size: int, tint: tuple[float, ...], seed: int) -> Pixels:
    """Rows of rounded tiles, each in its own shade."""
    u, v = coordinates(size, size)
    columns, rows = 8, 8
    row = np.floor(v * rows)
    x = (u * columns + 0.5 * (row % 2)) % columns
    shades = np.random.Generator(np.random.PCG64(seed)).uniform(0.7, 1.15, (rows, columns))
    shade = shades[row.astype(int), np.floor(x).astype(int)]
    across, along = x % 1 - 0.5, v * rows - row
    edge = smoothstep(0.42, 0.5, np.hypot(across, np.maximum(along - 0.5, 0.0)))
    return to_bytes(np.asarray(tint) * (shade * (1 - 0.65 * edge) * (0.75 + 0.25 * along))[..., None], 64)


def meadow(size: int) -> Pixels:
    """Mown grass in a chequer of light and dark, sprinkled with flowers."""
    u, v = coordinates(size, size)
    square = smoothstep(-0.08, 0.08, np.sin(2 * np.pi * 2 * u) * np.sin(2 * np.pi * 2 * v))
    blades = noise(u, v, 96, 96, 41)
    color = mix((0.13, 0.26, 0.07), (0.22, 0.38, 0.11), 0.6 * square + 0.4 * blades)
    flower = smoothstep(0.965, 0.985, noise(u, v, 64, 64, 42))
    return to_bytes(mix(color, np.broadcast_to((0.92, 0.86, 0.55), color.shape), flower), 48)


def dusk(width: int, height: int) -> Pixels:
    """An evening sky over ranges of hills with dark firs, painted on a backdrop; not tileable upwards."""
    u, v = coordinates(height, width)
    color = mix((0.10, 0.15, 0.33), (0.93, 0.50, 0.27), smoothstep(0.0, 0.72, v) ** 1.3)
    star = np.hypot((48 * u) % 1 - 0.5, (12 * v) % 1 - 0.5)
    lattice = np.random.Generator(np.random.PCG64(43)).random((12, 48))
    chosen = lattice[np.floor(12 * v).astype(int), np.floor(48 * u).astype(int)] > 0.72
    bright = (1 - smoothstep(0.06, 0.16, star)) * chosen * (1 - smoothstep(0.25, 0.5, v))
    color = mix(color, np.broadcast_to((0.95, 0.93, 0.80), color.shape), bright)
    ranges = ((0.62, (0.38, 0.27, 0.37)), (0.72, (0.22, 0.21, 0.30)), (0.83, (0.10, 0.15, 0.16)))
    for k, (level, tint) in enumerate(ranges):
        ridge = level - 0.10 * noise(u, np.zeros_like(v), 5 + 3 * k, 1, 44 + k)
        firs = 0.035 * np.abs((u * (40 + 14 * k)) % 1 - 0.5) * (k > 0)
        color = mix(color, np.broadcast_to(tint, color.shape), smoothstep(-0.004, 0.004, v - ridge - firs))
    return to_bytes(color, 56)


def clock(size: int) -> Pixels:
    """A clock face with numerals as bars, at ten past ten; outside it the tower's stone. Not tileable."""
    u, v = coordinates(size, size)
    x, y = u - 0.5, 0.5 - v
    radius, angle = np.hypot(x, y), np.arctan2(x, y)
    stone = np.asarray((0.62, 0.55, 0.45)) * (0.8 + 0.3 * noise(u, v, 24, 24, 51))[..., None]
    color = mix(stone, (0.93, 0.90, 0.80), 1 - smoothstep(0.40, 0.41, radius))
    rim = 1 - smoothstep(0.018, 0.026, np.abs(radius - 0.41))
    hour = np.abs((angle * 12 / (2 * np.pi)) % 1 - 0.5)
    bars = (hour > 0.46 - 0.02 / np.maximum(radius, 0.1)) & (np.abs(radius - 0.345) < 0.035)
    hands = np.zeros_like(u)
    for turn, length, width in ((10.17 / 12, 0.20, 0.018), (2 / 12, 0.29, 0.012)):
        along = x * np.sin(2 * np.pi * turn) + y * np.cos(2 * np.pi * turn)
        aside = np.abs(x * np.cos(2 * np.pi * turn) - y * np.sin(2 * np.pi * turn))
        hands = np.maximum(hands, (along > -0.04) & (along < length) & (aside < width))
    ink = np.maximum.reduce([rim, bars.astype(float), hands.astype(float)])
    return to_bytes(mix(color, (0.10, 0.08, 0.09), ink), 48)
