"""Pure array geometry on indexed triangles: areas, normals, tangents, compaction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .model import F32, F64, U32

SMALLEST_SCENE = 1e-6  # m: a point has no size of its own


def local_origin(low: F64, high: F64) -> F64:
    """(3,) [m] where coordinates of what lies in the box `low`..`high` should begin, for float32 to resolve it.

    A whole number of steps along each axis, the one next to the box's middle; a step is a power of two, over twice the
    box's diagonal. So it is zero for all that lies about the world's origin, and moving a scene by whole steps changes
    no coordinate. Zero as well for boxes that are not finite, which are refused elsewhere.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        middle, diagonal = 0.5 * (low + high), float(np.linalg.norm(high - low))
    if not (np.isfinite(middle).all() and np.isfinite(diagonal)):
        return np.zeros(3)
    step = 2.0 ** (np.frexp(max(diagonal, SMALLEST_SCENE))[1] + 1)
    origin: F64 = step * np.round(middle / step)
    return origin


def cross(a: F64, b: F64) -> F64:
    """(n, 3) cross products of rows: `np.cross` without its 50 us of preparation, which 100 000 small meshes feel."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    out = np.empty((len(a), 3))
    out[:, 0], out[:, 1], out[:, 2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return out


def face_cross(positions: F32, triangles: U32) -> F64:
    """(m, 3) cross product of two edges per triangle, in float64: twice the area times the normal."""
    p = positions.astype(np.float64)
    corner = p[triangles[:, 0]]
    return cross(p[triangles[:, 1]] - corner, p[triangles[:, 2]] - corner)


def degenerate(positions: F32, triangles: U32) -> NDArray[np.bool_]:
    """(m,) True where a triangle repeats an index or has zero area.

    Exactly zero, evaluated in float64: no tolerance that could eat thin but real triangles.
    """
    a, b, c = triangles.T
    repeated = (a == b) | (b == c) | (c == a)
    return repeated | ~face_cross(positions, triangles).any(axis=1)


def unit(vectors: NDArray[np.floating]) -> F64:
    """Rows scaled to length 1 in float64; rows without a direction (zero, NaN, infinite) become zero."""
    v = vectors.astype(np.float64)
    largest = np.abs(v).max(axis=1, keepdims=True, initial=0.0)
    usable = np.isfinite(largest) & (largest > 0.0)
    scaled = np.divide(v, largest, out=np.zeros_like(v), where=usable)  # so that squares cannot over- or underflow
    length = np.sqrt(np.einsum("ij,ij->i", scaled, scaled))[:, None]
    return np.divide(scaled, length, out=np.zeros_like(v), where=length > 0.0)


def _sum_at_vertices(per_face: F64, triangles: U32, count: int) -> F64:
    """(count, k) sum over the faces around each vertex."""
    corners = triangles.ravel()
    columns = [np.bincount(corners, np.repeat(column, 3), count) for column in per_face.T]
    return np.stack(columns, axis=1)


def area_weighted_normals(positions: F32, triangles: U32) -> F64:
    """(n, 3) unit vertex normals, each face weighing as much as its area; +y where no face gives a direction."""
    normals = unit(_sum_at_vertices(face_cross(positions, triangles), triangles, len(positions)))
    normals[~normals.any(axis=1)] = (0.0, 1.0, 0.0)
    return normals


def perpendicular(normals: F64) -> F64:
    """(n, 3) some unit vector at right angles to each unit normal (branch-free basis, Duff et al. 2017, listing 3)."""
    x, y, z = normals.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    return np.stack([1.0 + sign * x * x * a, sign * x * y * a, -sign * x], axis=1)


def uv_determinant(uvs: F32, triangles: U32) -> F64:
    """(m,) twice the signed area in texture space; its sign says whether the texture is mirrored on the face."""
    uv = uvs.astype(np.float64)
    e1 = uv[triangles[:, 1]] - uv[triangles[:, 0]]
    e2 = uv[triangles[:, 2]] - uv[triangles[:, 0]]
    return e1[:, 0] * e2[:, 1] - e2[:, 0] * e1[:, 1]


def split_mirrored(uvs: F32, triangles: U32) -> tuple[NDArray[np.int64], U32]:
    """Vertices shared by mirrored and unmirrored faces need two tangents: give each side its own copy.

    Returns (source, triangles): new vertex i is a copy of old vertex source[i].
    """
    count = len(uvs)
    keys = triangles.astype(np.int64) + count * (uv_determinant(uvs, triangles) < 0.0)[:, None]
    used, renamed = np.unique(keys.ravel(), return_inverse=True)
    return used % count, renamed.reshape(-1, 3).astype(np.uint32)


def tangents(positions: F32, normals: F32, uvs: F32, triangles: U32) -> F32:
    """(n, 4) unit tangents along +u and handedness: bitangent = cross(normal, tangent.xyz) * w points along -v.

    Averages each face's texture gradient at its vertices, area-weighted, then makes it orthogonal to the normal (after
    Lengyel, "Foundations of Game Engine Development 2", 2019, section 7.5). v grows downwards, hence the -v of glTF.
    """
    p, uv = positions.astype(np.float64), uvs.astype(np.float64)
    e1, e2 = (p[triangles[:, i]] - p[triangles[:, 0]] for i in (1, 2))
    d1, d2 = (uv[triangles[:, i]] - uv[triangles[:, 0]] for i in (1, 2))
    mirrored = np.where(uv_determinant(uvs, triangles) < 0.0, -1.0, 1.0)[:, None]
    along_u = unit((e1 * d2[:, 1:] - e2 * d1[:, 1:]) * mirrored)
    along_v = unit((e2 * d1[:, :1] - e1 * d2[:, :1]) * mirrored)
    area = np.linalg.norm(cross(e1, e2), axis=1)[:, None]
    sums = _sum_at_vertices(np.hstack([along_u * area, along_v * area]), triangles, len(p))

    n = normals.astype(np.float64)
    t = unit(sums[:, :3] - n * np.einsum("ij,ij->i", n, sums[:, :3])[:, None])
    lost = ~t.any(axis=1)
    t[lost] = perpendicular(n[lost])
    upwards = -sums[:, 3:]
    w = np.where(np.einsum("ij,ij->i", cross(n, t), upwards) < 0.0, -1.0, 1.0)
    return np.hstack([t, w[:, None]]).astype(np.float32)


def used_vertices(triangles: U32, count: int) -> tuple[NDArray[np.int64], U32]:
    """(source, triangles) without the vertices no triangle uses: new vertex i is old vertex source[i]."""
    used = np.zeros(count, bool)
    used[triangles.ravel()] = True
    renamed = np.cumsum(used) - 1
    return np.flatnonzero(used), renamed[triangles].astype(np.uint32)
