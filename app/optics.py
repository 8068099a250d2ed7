"""The thin lens, exact, in float64: the twin of glsl/lib/coc.glsl and glsl/lib/lens.glsl.

One derivation serves everything. A point at planar depth z, seen from the lens point (A/2) u instead of the lens
centre, is seen on the focal plane (depth d) displaced by (A/2) u (1 - d/z). One metre on that plane is H / (2 d
tan(fov/2)) pixels, so the image moves by

    u * K (1/d - 1/z)  pixels,   K = A H / (4 tan(fov/2)),

and the circle of confusion is the disc of those displacements: radius |coc|, signed, negative in front of the focal
plane.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Where nothing was hit [m]. Finite, so that no filter meets an infinity; its CoC differs from the limit by 1e-9 K.
SKY_DEPTH = 1e9

# Radius of the poster's focus zone: a CoC diameter below sqrt(2) px blurs less than a pixel's diagonal.
IN_FOCUS_COC_PX = math.sqrt(2.0) / 2.0


def coc_scale_px(aperture: float, height_px: float, fov_y: float) -> float:
    """K [px m] of a lens `aperture` [m] wide, an image `height_px` high and a vertical field of view `fov_y` [rad]."""
    return aperture * height_px / (4.0 * math.tan(fov_y / 2.0))


def coc_px(z: ArrayLike, scale_px: ArrayLike, inverse_focus: ArrayLike) -> Array:
    """Signed CoC radius [px] at planar depth `z` [m] for K = `scale_px`, 1/d = `inverse_focus` [1/m]; z may be inf."""
    return np.asarray(scale_px) * (np.asarray(inverse_focus) - 1.0 / np.asarray(z, np.float64))


def concentric_disc(square: ArrayLike) -> Array:
    """Unit square (n, 2) to unit disc (n, 2), area-preserving and continuous (Shirley and Chiu 1997)."""
    x, y = np.moveaxis(2.0 * np.asarray(square, np.float64) - 1.0, -1, 0)
    wide = np.abs(x) > np.abs(y)
    radius = np.where(wide, x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        angle = np.where(wide, (math.pi / 4) * (y / x), math.pi / 2 - (math.pi / 4) * (x / y))
    angle = np.where(radius == 0.0, 0.0, angle)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)


def aberrated_area(u: ArrayLike, s: float) -> Array:
    """Enclosed-area fraction t = r^2 whose density over [0, 1] is w(t) = 1 + s (2t - 1), from uniform `u`.

    The cumulative (1 - s) t + s t^2 = u solved for t, in the form that does not cancel at small s.
    """
    u = np.asarray(u, np.float64)
    return 2.0 * u / np.maximum((1.0 - s) + np.sqrt(np.maximum((1.0 - s) ** 2 + 4.0 * s * u, 0.0)), 1e-30)


def aberration_weight(t: ArrayLike, s: float) -> Array:
    """Relative brightness of the bokeh at enclosed-area fraction t = r^2; its mean over the disc is 1."""
    return 1.0 + s * (2.0 * np.asarray(t, np.float64) - 1.0)


def polygon_point(square: ArrayLike, blades: int, rotation: float) -> Array:
    """Unit square (n, 2) to a regular polygon inscribed in the unit circle, uniform by area, in closed form.

    One coordinate picks the blade and the direction within it (uniform along the edge), the other the enclosed area.
    """
    u, v = np.moveaxis(np.asarray(square, np.float64), -1, 0)
    blade = np.minimum(np.floor(blades * u), blades - 1)
    along = blades * u - blade
    theta = np.arctan((2.0 * along - 1.0) * math.tan(math.pi / blades))
    radius = np.sqrt(v) * math.cos(math.pi / blades) / np.cos(theta)
    angle = (blade + 0.5) * (2.0 * math.pi / blades) + theta + rotation
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)


def lens_point(
    square: ArrayLike, blades: int = 0, rotation: float = 0.0, anamorphic: float = 1.0, aberration: float = 0.0
) -> Array:
    """Point (n, 2) of the aperture, in units of its half diameter, from a point of the unit square (n, 2).

    `blades` < 3 is a disc. Spherical aberration redistributes the enclosed area; the anamorphic squeeze narrows x.
    """
    square = np.asarray(square, np.float64)
    if blades < 3:
        point = concentric_disc(square)
        area = np.sum(point * point, -1)
        scale = np.sqrt(np.where(area > 0.0, aberrated_area(area, aberration) / np.where(area > 0.0, area, 1.0), 0.0))
        point = point * scale[..., None]
        c, s = math.cos(rotation), math.sin(rotation)
        point = np.stack([c * point[..., 0] - s * point[..., 1], s * point[..., 0] + c * point[..., 1]], -1)
    else:
        redistributed = np.stack([square[..., 0], aberrated_area(square[..., 1], aberration)], -1)
        point = polygon_point(redistributed, blades, rotation)
    return np.asarray(point / np.array([anamorphic, 1.0]))


def lens_gauge(offset: ArrayLike, blades: int = 0, rotation: float = 0.0, anamorphic: float = 1.0) -> Array:
    """The factor by which the aperture must grow to just reach `offset` (n, 2): 1 on its rim (its Minkowski gauge)."""
    x, y = np.moveaxis(np.asarray(offset, np.float64), -1, 0)
    x = x * anamorphic
    radius = np.hypot(x, y)
    if blades < 3:
        return np.asarray(radius)
    sector = 2.0 * math.pi / blades
    angle = np.arctan2(y, x) - rotation
    within = angle - sector * (np.floor(angle / sector) + 0.5)
    return np.asarray(radius * np.cos(within) / math.cos(math.pi / blades))


def lens_area(blades: int = 0, anamorphic: float = 1.0) -> float:
    """Area of the aperture in units of its half diameter squared: pi for a disc."""
    area = math.pi if blades < 3 else 0.5 * blades * math.sin(2.0 * math.pi / blades)
    return area / anamorphic


def lens_spread(blades: int = 0, anamorphic: float = 1.0, aberration: float = 0.0) -> float:
    """Mean square distance of the aperture's light from its centre, in units of its half diameter squared.

    Of a disc 1/2, of a regular n-gon in the unit circle (2 + cos(2 pi / n)) / 6; aberration s moves the mean of the
    enclosed-area fraction from 1/2 to 1/2 + s/6.
    """
    even = 0.5 if blades < 3 else (2.0 + math.cos(2.0 * math.pi / blades)) / 6.0
    return even * (1.0 + aberration / 3.0) * 0.5 * (1.0 + 1.0 / (anamorphic * anamorphic))


def barrel_shift(image_px: ArrayLike, size_px: ArrayLike, cat_eye: float) -> Array:
    """Where the lens barrel's disc lies (n, 2) [half lens diameters], seen from a point of the image (n, 2) [px].

    Cat-eye vignetting: light from off the axis must also pass a second rim of the lens' own radius, in front of the
    aperture (Kolb, Mitchell and Hanrahan 1995 trace the real ones). A ray from the right that meets the aperture at u
    crosses that rim further right, at u plus a length that grows with the angle, so the part of the lens that passes
    is a disc shifted to the left: away from what is looked at, by `cat_eye` in the corners. Blurred lights behind
    focus, which lie at u coc from their place, are cut on the side away from the picture's centre; those in front of
    focus, mirrored by their negative coc, on the side towards it.
    """
    image_px, size_px = np.asarray(image_px, np.float64), np.asarray(size_px, np.float64)
    return np.asarray(-cat_eye * (2.0 * image_px - size_px) / np.linalg.norm(size_px))


def passes_barrel(point: ArrayLike, shift: ArrayLike) -> NDArray[np.bool_]:
    """Whether light through aperture point (n, 2) passes the barrel shifted by `shift` (n, 2)."""
    apart = np.asarray(point, np.float64) - np.asarray(shift, np.float64)
    return np.asarray(np.sum(apart * apart, -1) <= 1.0)


def barrel_reach(point: ArrayLike, shift: ArrayLike) -> Array:
    """The factor that lengthens `point` (n, 2; not 0) until it meets the barrel's rim, for a shift no longer than 1.

    With |f point - shift| = 1: the positive root f.
    """
    point, shift = np.asarray(point, np.float64), np.asarray(shift, np.float64)
    square, along = np.sum(point * point, -1), np.sum(point * shift, -1)
    rest = np.maximum(1.0 - np.sum(shift * shift, -1), 0.0)
    return np.asarray((along + np.sqrt(along * along + square * rest)) / square)
