"""Ray hits in float64, for tests: slow, simple, sharing no code or method with the shaders.

Method: Moller and Trumbore 1997 in double precision, all triangles against all rays in chunks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

CHUNK = 2_000_000  # ray-triangle pairs at a time: about 300 MB of temporaries


@dataclass(frozen=True)
class Hits:
    """What each ray hits first. `triangle` is -1, and `t` inf, where nothing is hit."""

    t: F64  # (r,)
    triangle: NDArray[np.int64]  # (r,)
    barycentrics: F64  # (r, 2) weights of the second and third vertex


def intersect_triangle(origins: F64, directions: F64, corners: F64) -> tuple[F64, F64, F64]:
    """Distance and weights (v, w) of each ray's crossing with its own triangle's plane; broadcasts over leading axes.

    `corners` (..., 3 vertices, 3). A crossing is inside where v, w and 1 - v - w are all >= 0. Rays parallel to the
    plane give NaN or infinity.
    """
    a, b, c = (corners[..., i, :] for i in range(3))
    edge1, edge2 = b - a, c - a
    p = np.cross(directions, edge2)
    s = origins - a
    q = np.cross(s, edge1)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / np.einsum("...i,...i", edge1, p)
        v = np.einsum("...i,...i", s, p) * inverse
        w = np.einsum("...i,...i", directions, q) * inverse
        t = np.einsum("...i,...i", edge2, q) * inverse
    return t, v, w


def edge_function(a: F64, b: F64) -> F64:
    """Twin of the shader's: a.x b.y - a.y b.x, (..., 2). Its sign is exact for float32 values: products fit 53 bits."""
    area: F64 = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return area


def intersect_boxes(origins: F64, directions: F64, lo: F64, hi: F64, t_min: float, t_max: float) -> F64:
    """Entry distance of each ray into its own box, all (..., 3); inf where missed. Faces belong to the box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        planes = np.stack([lo - origins, hi - origins]) / directions
    parallel = directions == 0
    within = (lo <= origins) & (origins <= hi)
    enter = np.where(parallel, np.where(within, -np.inf, np.inf), planes.min(axis=0)).max(axis=-1)
    leave = np.where(parallel, np.where(within, np.inf, -np.inf), planes.max(axis=0)).min(axis=-1)
    enter, leave = np.maximum(enter, t_min), np.minimum(leave, t_max)
    entry: F64 = np.where(enter <= leave, enter, np.inf)
    return entry


def brute_force(
    origins: F64, directions: F64, corners: F64, t_min: float = 0.0, t_max: float = np.inf, slack: float = 0.0
) -> Hits:
    """The closest hit of each ray (r, 3) with all triangles (m, 3, 3); equal distances: the lowest index.

    `slack` widens every triangle by this much in barycentric weight, to ask what a rounded test may still accept.
    """
    rays = len(origins)
    best = Hits(np.full(rays, np.inf), np.full(rays, -1), np.zeros((rays, 2)))
    step = max(1, CHUNK // max(len(corners), 1))
    for begin in range(0, rays if len(corners) else 0, step):
        part = slice(begin, begin + step)
        t, v, w = intersect_triangle(origins[part, None], directions[part, None], corners[None])
        with np.errstate(invalid="ignore"):  # NaN: parallel to the plane, hence outside
            inside = (v >= -slack) & (w >= -slack) & (v + w <= 1.0 + slack) & (t >= t_min) & (t <= t_max)
        t = np.where(inside, t, np.inf)
        nearest = np.argmin(t, axis=1)
        row = np.arange(len(nearest))
        best.t[part] = t[row, nearest]
        best.triangle[part] = np.where(np.isfinite(best.t[part]), nearest, -1)
        best.barycentrics[part] = np.stack([v[row, nearest], w[row, nearest]], axis=-1)
    return best
