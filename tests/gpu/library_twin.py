"""Float64 twins of the functions of glsl/lib that have no other home."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.gpu.octahedral import HANDED_BIT, SNORM, octahedral_decode

from . import post_twin, shading_twin

Array = NDArray[np.float64]

USABLE = float(np.float32(1e30))
GROUP_ITEMS, ROW_GROUPS = 64, 32768


def powers(x: ArrayLike) -> Array:
    """(n, 4) of x^0 to x^3."""
    return np.asarray(x, float)[..., None] ** np.arange(4)


def hemisphere_diffuse(sky: ArrayLike, ground: ArrayLike, y: ArrayLike) -> Array:
    """Two thirds of the way from the horizon's radiance to that at height y."""
    horizon = shading_twin.hemisphere_radiance(sky, ground, np.zeros_like(np.asarray(y, float)))
    return horizon + 2.0 / 3.0 * (shading_twin.hemisphere_radiance(sky, ground, y) - horizon)


def compressed_luminance(rgb: ArrayLike) -> Array:
    """Reinhard's operator on luminance, as what is missing from white."""
    return 1.0 - 1.0 / (1.0 + shading_twin.luminance(rgb))


def finite(v: ArrayLike) -> Array:
    """The finite components, 0 for the others."""
    return np.nan_to_num(np.asarray(v, float), nan=0.0, posinf=0.0, neginf=0.0)


def within_half(light: ArrayLike) -> Array:
    """Finite light that float16 can hold."""
    return np.clip(np.asarray(light, float), -post_twin.LARGEST_RADIANCE, post_twin.LARGEST_RADIANCE)


def usable(c: ArrayLike) -> NDArray[np.bool_]:
    """(n, 3) whether each component is a number below 1e30 either way."""
    return np.abs(np.asarray(c, float)) < USABLE


def is_usable(c: ArrayLike) -> NDArray[np.bool_]:
    return usable(c).all(-1)


def catmull_rom_weights(f: ArrayLike) -> Array:
    """(n, 4) of the outer weights, the middle two together, and where between those their common sample lies: w0, w12,
    w3, offset12.
    """
    w = shading_twin.catmull_rom(f)
    middle = w[..., 1] + w[..., 2]
    return np.stack([w[..., 0], middle, w[..., 3], w[..., 2] / middle], -1)


def order(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    """The smaller and the larger of each pair."""
    pair = np.sort(np.stack([a, b]), axis=0)
    return pair[0], pair[1]


def median9(v: Sequence[ArrayLike] | ArrayLike) -> Array:
    """Of nine values along the first axis."""
    return np.median(np.asarray(v, float), axis=0)


def unpack_normal(bits: ArrayLike) -> Array:
    """(n, 3) from two snorm16, of which two bit patterns stand for -1."""
    halves = np.ascontiguousarray(np.asarray(bits, np.uint32)).view(np.int16).reshape(-1, 2)
    return octahedral_decode(np.maximum(halves / SNORM, -1.0))


def unpack_tangent(bits: ArrayLike) -> Array:
    """(n, 4): the direction of what is left of the bits without the handedness, and that."""
    bits = np.asarray(bits, np.uint32)
    handed = (bits & np.uint32(HANDED_BIT)) != 0
    return np.column_stack([unpack_normal(bits & ~np.uint32(HANDED_BIT)), np.where(handed, -1.0, 1.0)])


def coarse_center(i: ArrayLike, side: ArrayLike) -> Array:
    """Mean of the half-res texels side i to side (i + 1) - 1."""
    i, side = np.asarray(i), np.asarray(side)
    return (side * i + side * (i + 1) - 1) / 2.0


def coarse_span(p: ArrayLike, farthest: ArrayLike, side: ArrayLike, size: ArrayLike) -> Array:
    """(n, 2) coarse texels of the first and the last half-res texel within an edge's grown reach of p."""
    p, side = np.asarray(p), np.asarray(side)
    reach = np.floor(np.asarray(farthest, float) + np.sqrt(0.5) * (side - 1))
    return np.stack([np.maximum(p - reach, 0) // side, np.minimum(p + reach, np.asarray(size) - 1) // side], -1)


def add_sample(mean: ArrayLike, withheld: ArrayLike, value: ArrayLike) -> Array:
    """(n, 4) the mean with one more sample and their number, without rounding: what is withheld is given back."""
    mean, value = np.asarray(mean, float), np.where(usable(value), value, 0.0)
    count = mean[..., 3:] + 1.0
    return np.concatenate([mean[..., :3] + (value - mean[..., :3]) / count - withheld, count], -1)


def folded_groups(groups: ArrayLike) -> NDArray[np.int64]:
    """(n, 2) along x and y: a row, then as many rows as it takes."""
    groups = np.asarray(groups, np.int64)
    return np.stack([np.minimum(groups, ROW_GROUPS), -(-groups // ROW_GROUPS)], -1)


def group_of(group: ArrayLike) -> NDArray[np.int64]:
    x, y = np.moveaxis(np.asarray(group, np.int64), -1, 0)
    return ROW_GROUPS * y + x


def groups_over(items: ArrayLike) -> NDArray[np.int64]:
    return folded_groups(-(-np.asarray(items, np.int64) // GROUP_ITEMS))


def item_of(group: ArrayLike, lane: ArrayLike) -> NDArray[np.int64]:
    return group_of(group) * GROUP_ITEMS + np.asarray(lane, np.int64)


def list_place(class_: ArrayLike, slot: ArrayLike, most: ArrayLike) -> NDArray[np.int64]:
    return np.asarray(class_, np.int64) * np.asarray(most, np.int64) + np.asarray(slot, np.int64)
