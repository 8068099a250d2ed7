"""How wrong a picture is, beside the true one: error of its light, and of what a viewer sees of it.

Pictures are linear radiance (h, w, 3); sums run in float64. `rmse` and `relative_mse` judge the light itself; `psnr`
and FLIP judge it as displayed by default: clipped to 0..1 and sRGB-encoded, without exposure or tone curve. Every
figure can be taken over a region, a boolean (h, w); over an empty one it is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import UserError
from ..tone import srgb_encode

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WHOLE = "whole"  # the name of the region that is all of the picture

# Added to the squared truth that squared errors are divided by: black pixels must not decide the mean. The value that
# papers on denoising share (Rousselle, Knaus and Zwicker 2011), so that figures compare.
RELATIVE_EPSILON = 0.01


@dataclass(frozen=True)
class Errors:
    """Of one picture, over one region."""

    rmse: float  # linear radiance; 0 is identical
    relative_mse: float  # no unit; 0 is identical
    psnr: float  # dB, of the displayed picture; infinity is identical
    flip: float = math.nan  # mean, 0 to 1, of the displayed picture; NaN: not measured


def measure(
    picture: ArrayLike, truth: ArrayLike, regions: Mapping[str, Mask] | None = None, *, flip: bool = True
) -> dict[str, Errors]:
    """Every metric over the whole picture, first, and over each region.

    FLIP is NaN if it is not wanted (it takes longer than all others together) or not installed.
    """
    squared, relative, shown_squared = squared_errors(picture, truth)
    seen = flip_map(truth, picture) if flip and has_flip() else np.full(squared.shape, math.nan)
    return {
        name: errors_of_means(
            mean_over(squared, region),
            mean_over(relative, region),
            mean_over(shown_squared, region),
            mean_over(seen, region),
        )
        for name, region in {WHOLE: None, **(regions or {})}.items()
    }


def errors_of_means(squared: float, relative: float, shown_squared: float, flip: float = math.nan) -> Errors:
    """The figures that follow from mean squared errors."""
    return Errors(math.sqrt(squared), relative, decibels(shown_squared), flip)


def rmse(picture: ArrayLike, truth: ArrayLike, region: Mask | None = None) -> float:
    """Root mean square difference of linear radiance."""
    return math.sqrt(mean_over(squared_errors(picture, truth)[0], region))


def relative_mse(picture: ArrayLike, truth: ArrayLike, region: Mask | None = None) -> float:
    """Mean over pixels and channels of (x - r)^2 / (r^2 + RELATIVE_EPSILON) for a picture x and the true one, r."""
    return mean_over(squared_errors(picture, truth)[1], region)


def psnr(picture: ArrayLike, truth: ArrayLike, region: Mask | None = None) -> float:
    """Peak signal-to-noise ratio [dB] of the displayed pictures, whose peak is 1; infinite where they are equal."""
    return decibels(mean_over(squared_errors(picture, truth)[2], region))


def decibels(mean_square: float) -> float:
    """The ratio of a peak of 1 to a mean square error, in dB."""
    return -10.0 * math.log10(mean_square) if mean_square != 0.0 else math.inf


def squared_errors(picture: ArrayLike, truth: ArrayLike) -> tuple[Array, Array, Array]:
    """Squared, relative squared and displayed squared error (h, w) of each pixel, means over its channels: the twin of
    glsl/lib/errors.glsl.
    """
    x, r = _pair(picture, truth)
    squared = (x - r) ** 2
    shown_squared = (shown(x) - shown(r)) ** 2
    return squared.mean(-1), (squared / (r * r + RELATIVE_EPSILON)).mean(-1), shown_squared.mean(-1)


def mean_over(values: Array, region: Mask | None = None) -> float:
    """Mean of a value at each pixel (h, w) over a region, or over all; NaN where there is none."""
    chosen = values if region is None else values[region]
    return float(chosen.mean(dtype=np.float64)) if chosen.size else math.nan


def shown(linear: ArrayLike) -> Array:
    """Display values 0 to 1 of linear light, as the default settings show it."""
    return srgb_encode(np.clip(linear, 0.0, 1.0))


def displayed(linear: ArrayLike) -> NDArray[np.uint8]:
    """The 8-bit picture of the same."""
    return np.rint(255.0 * shown(linear)).astype(np.uint8)


def has_flip() -> bool:
    """Whether FLIP can be measured in this installation."""
    try:
        _flip_evaluator()
    except UserError:
        return False
    return True


def flip_map(truth: ArrayLike, picture: ArrayLike) -> Array:
    """FLIP, 0 to 1, at each pixel (h, w): what a viewer sees of the difference when flipping between the displayed
    pictures (Andersson et al. 2020, LDR), at the metric's default of 67 pixels per degree.

    Raises UserError without the `metrics` extra.
    """
    r, x = _pair(truth, picture)
    displays = (np.ascontiguousarray(shown(linear), np.float32) for linear in (r, x))
    return np.asarray(_flip_evaluator().evaluate(*displays, "LDR", applyMagma=False)[0][..., 0], np.float64)


def mean_flip(truth: ArrayLike, picture: ArrayLike, region: Mask | None = None) -> float:
    """Its mean."""
    return mean_over(flip_map(truth, picture), region)


def _pair(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    """Both pictures in float64. Raises UserError if they cannot be compared."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    for picture in (a, b):
        if picture.ndim != 3 or picture.shape[-1] != 3:
            raise UserError(f"a picture to compare has the shape {picture.shape}; give (height, width, 3)")
    if a.shape != b.shape:
        sizes = " and ".join(f"{p.shape[1]}x{p.shape[0]}" for p in (a, b))
        raise UserError(f"the pictures to compare are {sizes} pixels; draw both at one size")
    return a, b


def _flip_evaluator() -> Any:
    try:
        import flip_evaluator
    except ImportError:
        raise UserError("FLIP needs flip-evaluator: pip install 'hybrid-dof[metrics]'") from None
    return flip_evaluator
