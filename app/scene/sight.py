"""What a camera may see of boxes, through a pinhole and through a lens: depths and kinds, never too little.

In camera axes a pixel of slope s, seen from lens point o, shows s z + o (1 - z/d) at planar depth z, focused at d
(app/optics.py). With |o| <= r and |s| <= t along an axis, what can be seen between the lens and the focal plane is

    |x| <= t z + r (1 - z/d)  <=>  +-x - (t - r/d) z <= r,

a half-space per side of the picture, and so is what can be seen behind it, with -r for r. A pinhole is r = 0.

Of a box, p = c + h u with |u| <= 1 along each axis, the least of any a . p is a . c - |a| . h. Weak duality makes bounds
of it: whatever w >= 0, no point with n . p <= l and f . p >= z0 has w n . p - f . p > w l - z0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..settings import Lens
from .boxes import Boxes
from .model import F64

RIM_PX = 2.0  # half-resolution pixels of an odd size reach one pixel beyond the picture; and rounding
ROUNDING = 2.0**-20  # of a coordinate: what float32 makes of a position on its way to the screen, eight times


@dataclass(frozen=True)
class Sight:
    """What may be seen. Depths in m; infinity where nothing can be."""

    nearest: float  # of the picture that a pinhole makes
    nearest_through_lens: float  # of what rays through the lens meet in front of focus
    kinds: int  # bits of Boxes.kinds of all that either of them shows


def sight(boxes: Boxes, origin: F64, camera: Camera, lens: Lens, size: tuple[int, int], near_plane: float) -> Sight:
    """What of the boxes a picture of `size` px may show. `origin`: of the space in which the GPU keeps positions."""
    eye, axes, focus, radius = np.asarray(camera.eye), camera.axes, lens.focus_distance, 0.5 * lens.aperture
    rounding = ROUNDING * (boxes.farthest_from(origin) + float(np.abs(eye - origin).max()))
    centre, half = boxes.centre - eye, boxes.half + rounding
    slopes = math.tan(camera.fov_y / 2.0) * np.array([size[0] / size[1], 1.0]) * (1.0 + 2.0 * RIM_PX / np.array(size))
    # three wedges: the pinhole's, the lens' in front of focus, and behind it
    begins, limits = np.array([near_plane, near_plane, max(focus, near_plane)]), np.array([0.0, radius, -radius])
    seen, nearest = _wedges(axes, slopes[:, None] - limits / focus, limits, begins, centre, half)
    through = nearest[1] if nearest[1] <= focus else math.inf
    return Sight(nearest[0], min(nearest[0], through), boxes.kinds_of(seen))


def _wedges(
    axes: F64, slopes: F64, limits: F64, begins: F64, centre: F64, half: F64
) -> tuple[NDArray[np.bool_], list[float]]:
    """Which boxes (n,) may hold points in any of some wedges, and the least depth of such points per wedge.

    A wedge is what lies at least its `begins` deep within the half-spaces +-x - slope z <= its `limits`, with one of
    the `slopes` (2, w) for each axis of the picture.
    """
    forward = -axes[2]
    sides = np.array([axes[0], -axes[0], axes[1], -axes[1]])
    normals = sides - np.repeat(slopes, 2, axis=0).T[..., None] * forward  # (w, 4, 3)
    # w n - f and w n + f bend where one of their components vanishes: the best w of one half-space is among those.
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = normals / forward
        least = np.where(ratios < 0.0, -1.0 / ratios, 0.0)
    away = np.where(np.isfinite(ratios) & (ratios > 0.0), ratios, 0.0)  # n - w f, so that w = 0 is n itself
    least = np.where(np.isfinite(least), least, 0.0)
    out = normals[:, :, None] - away[..., None] * forward  # (w, 4, 3, 3)
    far = forward + least[..., None] * normals[:, :, None]
    rows = np.concatenate([out, far], axis=1)
    ends = np.concatenate(
        [limits[:, None, None] - away * begins[:, None, None], limits[:, None, None] * least], axis=1
    ).reshape(len(limits), 24, 1)
    candidates = np.flatnonzero(centre @ forward + half @ np.abs(forward) >= begins.min())
    low = _lowest(rows.reshape(-1, 3), centre[candidates], half[candidates]).reshape(len(limits), 24, -1) - ends
    inside = (low[:, :12] <= 0.0).all(axis=1)  # (w, k)
    depth = np.where(inside, low[:, 12:].max(axis=1), np.inf).min(axis=1, initial=np.inf)
    seen = np.zeros(len(centre), np.bool_)
    seen[candidates[inside.any(axis=0)]] = True
    return seen, [max(float(d), float(begin)) for d, begin in zip(depth, begins, strict=True)]


def _lowest(rows: F64, centre: F64, half: F64) -> F64:
    """(r, n) the least of row . p over each box."""
    return np.asarray(rows @ centre.T - np.abs(rows) @ half.T)
