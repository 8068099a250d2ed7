"""Unit vectors in 32 bits: the float64 twin of glsl/lib/octahedral.glsl (Cigolle et al. 2014), and vertex packing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

SNORM = 32767.0  # the snorm16 that means 1
HANDED_BIT = 1 << 16  # lowest bit of the tangent's second number: set where the handedness is -1


def sign_not_zero(v: ArrayLike) -> Array:
    """+1 where v >= 0, else -1."""
    return np.where(np.asarray(v) >= 0.0, 1.0, -1.0)


def octahedral_encode(n: ArrayLike) -> Array:
    """Unit vectors (n, 3) to the square -1..1 (n, 2); a zero vector becomes the square's centre, +z."""
    n = np.asarray(n, np.float64)
    norm = np.abs(n).sum(-1, keepdims=True)
    p = np.divide(n[..., :2], norm, out=np.zeros_like(n[..., :2]), where=norm > 0.0)
    return np.where(n[..., 2:] < 0.0, (1.0 - np.abs(p[..., ::-1])) * sign_not_zero(p), p)


def octahedral_decode(p: ArrayLike) -> Array:
    """Square -1..1 (n, 2) to unit vectors (n, 3)."""
    p = np.asarray(p, np.float64)
    z = 1.0 - np.abs(p).sum(-1, keepdims=True)
    n = np.concatenate([p - sign_not_zero(p) * np.maximum(-z, 0.0), z], -1)
    return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))


def pack_normals(normals: ArrayLike) -> NDArray[np.uint32]:
    """Unit vectors (n, 3) as snorm16x2 in one uint32 each, x in the low half."""
    return _pack(np.rint(octahedral_encode(normals) * SNORM))


def pack_tangents(tangents: ArrayLike) -> NDArray[np.uint32]:
    """Tangents (n, 4) as `pack_normals` does, with the second number even and the handedness w in its lowest bit."""
    tangents = np.asarray(tangents, np.float64)
    steps = octahedral_encode(tangents[:, :3]) * SNORM
    steps[:, 1] = 2.0 * np.rint(np.clip(steps[:, 1], 1.0 - SNORM, SNORM - 1.0) / 2.0)
    packed = _pack(np.rint(steps))
    return np.where(tangents[:, 3] < 0.0, packed | np.uint32(HANDED_BIT), packed).astype(np.uint32)


def _pack(steps: NDArray[Any]) -> NDArray[np.uint32]:
    halves = np.ascontiguousarray(steps.astype("<i2"))
    return halves.view("<u4")[:, 0]
