"""What a camera may see of boxes through its lens: the nearest depth and the kinds of surfaces, never too little.

In camera axes a pixel of slope s, seen from lens point o, shows s z + o (1 - z/d) at planar depth z, focused at d
(app/optics.py). With |s| <= t and |o| <= r along an axis of the picture, all that can be seen lies within

    |x| <= t z + r |1 - z/d| <= (t + r/d) z + r,

a half-space n . p <= r for each side of the picture, with n = +-(the axis) - (t + r/d) f for the unit vector f ahead. A
pinhole's view is among it: r = 0.

Of a box, p = c + h u with |u| <= 1 along each axis, the least of any a . p is a . c - |a| . h. A box is not seen whose
least n . p exceeds r for some side, nor one apart from the box around all that is seen: a wall behind one's back is
told by that alone. Of what is seen of the rest, weak duality bounds the depth:

    f . p >= f . p + w (n . p - r) >= least of (f + w n) . p over the box - w r    for any w >= 0,

which is concave in w and bends where a component of f + w n vanishes: the best bound for one side is at such a w, or 0.
It is exact for a floor that only the lower side cuts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..camera import Camera
from ..settings import Lens
from .boxes import Boxes
from .model import F64

RIM_PX = 2.0  # half-resolution pixels of an odd size reach one pixel beyond the picture; the other is for rounding
ROUNDING = 2.0**-20  # of a coordinate: eight times what float32 makes of a position on its way to the screen


@dataclass(frozen=True)
class Sight:
    """What may be seen."""

    nearest: float  # planar depth, m; infinity where nothing can be
    kinds: int  # bits of Boxes.kinds


@lru_cache(maxsize=8)  # a frame asks twice, whoever foresees it and whoever draws it; each side of a split screen
def sight(boxes: Boxes, camera: Camera, lens: Lens, size: tuple[int, int], near_plane: float) -> Sight:
    """What of the boxes a picture of `size` px may show from `near_plane` [m] on."""
    axes, ahead, radius = camera.axes, -camera.axes[2], 0.5 * lens.aperture
    centre = boxes.centre - camera.eye
    half = boxes.half + ROUNDING * (boxes.reach + np.abs(centre).max(initial=0.0))
    rim = 1.0 + 2.0 * RIM_PX / np.array(size)
    slopes = rim * math.tan(camera.fov_y / 2.0) * np.array([size[0] / size[1], 1.0]) + radius / lens.focus_distance
    normals = np.array([axes[0], -axes[0], axes[1], -axes[1]]) - np.repeat(slopes, 2)[:, None] * ahead
    weights = _bends(ahead, normals)
    duals = (ahead + weights[..., None] * normals[:, None]).reshape(-1, 3)
    rows = np.concatenate([normals, [ahead, -ahead], duals])
    least = rows @ centre.T - np.abs(rows) @ half.T  # (18, n)
    first, last = np.maximum(least[4], (least[6:] - radius * weights.reshape(-1, 1)).max(axis=0)), -least[5]
    low, high = _box_of_view(axes, slopes, radius, float(last.max(initial=near_plane)))
    seen = (least[:4] <= radius).all(axis=0) & (np.maximum(first, near_plane) <= last)
    seen &= ((centre - half <= high) & (centre + half >= low)).all(axis=1)
    nearest = max(float(first.min(where=seen, initial=math.inf)), near_plane)
    return Sight(nearest, int(np.bitwise_or.reduce(boxes.kinds[seen], initial=0)))


def _box_of_view(axes: F64, slopes: F64, radius: float, deepest: float) -> tuple[F64, F64]:
    """Corners (3,) of a box around all that is seen from the lens down to a depth [m], about the eye."""
    x, y = slopes * deepest + radius
    frame = [(radius, radius, 0.0), (x, y, -deepest)]  # a quarter of it, the others mirrored
    ends = np.array([(i * right, j * up, back) for right, up, back in frame for i in (-1, 1) for j in (-1, 1)]) @ axes
    return ends.min(axis=0), ends.max(axis=0)


def _bends(ahead: F64, normals: F64) -> F64:
    """(k, 3) where each component of ahead + w * normals (k, 3) vanishes; 0 for none with w > 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = -ahead / normals
    return np.where(np.isfinite(weights) & (weights > 0.0), weights, 0.0)
