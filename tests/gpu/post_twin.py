"""Float64 twins of the post-process's pure functions: glsl/lib/splat, kernel, tile and tile_reach."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.frame.targets import TILE_PX
from app.optics import IN_FOCUS_COC_PX

Array = NDArray[np.float64]

LARGEST_RADIANCE = 6e4
REACH_MARGIN_PX = 3.0
GOLDEN, ROOT = 0.618033989, 0.414213562


def smoothstep(low: ArrayLike, high: ArrayLike, x: ArrayLike) -> Array:
    t = np.clip((np.asarray(x, float) - low) / (np.asarray(high, float) - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def finite_radiance(c: ArrayLike) -> Array:
    c = np.asarray(c, float)
    return np.where(c > 0.0, np.minimum(c, LARGEST_RADIANCE), 0.0)


def gathered_coc(coc: ArrayLike, limit: ArrayLike) -> Array:
    return np.clip(
        np.nan_to_num(np.asarray(coc, float), nan=0.0, posinf=np.inf, neginf=-np.inf), -np.asarray(limit), limit
    )


def silhouette_px(own: ArrayLike, coc: ArrayLike) -> Array:
    return np.abs(np.minimum(own, coc))


def enclosed_light(t: ArrayLike, aberration: ArrayLike) -> Array:
    t = np.minimum(t, 1.0)
    return t * (1.0 - np.asarray(aberration) + aberration * t)


def ring_light(inner2: ArrayLike, outer2: ArrayLike, radius2: ArrayLike, aberration: ArrayLike) -> Array:
    r2 = np.maximum(radius2, 1e-6)
    return enclosed_light(np.asarray(outer2) / r2, aberration) - enclosed_light(np.asarray(inner2) / r2, aberration)


def ring_area(inner2: ArrayLike, outer2: ArrayLike, radius2: ArrayLike) -> Array:
    r2 = np.maximum(radius2, 1e-6)
    inner, outer = (np.minimum(np.asarray(x) / r2, 1.0) for x in (inner2, outer2))
    return np.stack([outer - inner, outer**2 - inner**2], -1)


def shrunk_px2(radius: ArrayLike, variance: ArrayLike, spread: ArrayLike) -> Array:
    square = np.square(np.asarray(radius, float))
    return np.maximum(square - 2.0 * np.asarray(variance) / spread, 0.25 * square)


def fitted_px2(radius2: ArrayLike, spacing: ArrayLike, s: ArrayLike) -> Array:
    radius2, s, unit2 = np.asarray(radius2, float), np.asarray(s, float), np.square(np.asarray(spacing, float))
    t = radius2 / unit2
    j = np.ceil(np.sqrt(t) - 0.5)
    a, b = np.square(j - 0.5), np.square(j + 0.5)
    constant, linear = 0.5 * (a + b) - t * (0.5 + s / 6.0), 0.5 * (1.0 - s) * a * b
    square = s * (3.0 * a * a * b - a**3 + 2.0 * np.square(j * (j - 1.0))) / 6.0
    y = 2.0 * constant / np.maximum(linear + np.sqrt(np.maximum(linear**2 + 4.0 * square * constant, 0.0)), 1e-6)
    return np.where(j < 2.0, radius2, unit2 / np.clip(y, 1.0 / b, 1.0 / a))


def fitted_even_px2(radius2: ArrayLike, spacing: ArrayLike) -> Array:
    return fitted_px2(radius2, spacing, 0.0)


def front_share(coc: ArrayLike, begin: ArrayLike, end: ArrayLike) -> Array:
    return smoothstep(begin, end, -np.asarray(coc, float))


def fore_share(coc: ArrayLike, nearest: ArrayLike, fade: ArrayLike) -> Array:
    return 1.0 - smoothstep(0.0, 1.0, (np.asarray(coc, float) - nearest) / np.asarray(fade))


def stacked(fore: ArrayLike, behind: ArrayLike) -> Array:
    fore, behind = np.asarray(fore, float), np.asarray(behind, float)
    fore = fore / np.maximum(fore[..., 3:], 1.0)
    return fore + behind * np.minimum(1.0, (1.0 - fore[..., 3:]) / np.maximum(behind[..., 3:], 1e-6))


def ring_count(radius_texels: ArrayLike, most: int) -> NDArray[np.int64]:
    return np.clip(np.ceil(np.asarray(radius_texels) - 0.5), 1, most).astype(int)


def ring_rim(k: ArrayLike, n: ArrayLike) -> Array:
    return (np.asarray(k) + 0.5) / (np.asarray(n) + 0.5)


def ring_taps(k: int) -> int:
    return 8 * k if k else 1


def kernel_taps(n: int) -> int:
    return (2 * n + 1) ** 2


def first_tap(k: int) -> int:
    return kernel_taps(k - 1) if k else 0


def aperture_point(turn: float, area: float, blades: int, rotation: float, anamorphic: float) -> Array:
    """A point of the aperture; the polygon is built from its corners, not from the closed form that the shader uses."""
    if blades < 3:
        angle = 2.0 * math.pi * turn
        point = math.sqrt(area) * np.array([math.cos(angle), math.sin(angle)])
    else:
        edge = math.floor(turn % 1.0 * blades)
        along = turn % 1.0 * blades - edge
        a, b = (2.0 * math.pi * (edge + i) / blades + rotation for i in (0, 1))
        point = math.sqrt(area) * (
            (1.0 - along) * np.array([math.cos(a), math.sin(a)]) + along * np.array([math.cos(b), math.sin(b)])
        )
    return point / np.array([anamorphic, 1.0])


def tap_gauge(k: int, n: int, frame: int) -> float:
    inner, outer = ring_rim(k - 1, n) ** 2, ring_rim(k, n) ** 2
    return math.sqrt(inner + (outer - inner) * ((0.5 + (frame & 1023) * GOLDEN) % 1.0)) if k else 0.0


def kernel_tap(index: int, n: int, frame: int, blades: int, rotation: float, anamorphic: float) -> Array:
    if index == 0:
        return np.zeros(2)
    k = (math.isqrt(index) + 1) // 2
    turn = (index - first_tap(k) + (k * GOLDEN + (frame & 1023) * ROOT) % 1.0) / ring_taps(k)
    return aperture_point(turn, tap_gauge(k, n, frame) ** 2, blades, rotation, anamorphic)


def tile_count(size: ArrayLike) -> NDArray[np.int64]:
    """(n, 2) for (n, 2) px."""
    return np.ceil(np.asarray(size, float) / TILE_PX).astype(int)


def tile_reach(radius: ArrayLike) -> NDArray[np.int64]:
    radius = np.asarray(radius, float)
    return np.where(
        radius <= IN_FOCUS_COC_PX, 0, 1 + np.floor((np.maximum(radius, 0.0) + REACH_MARGIN_PX) / TILE_PX)
    ).astype(int)
