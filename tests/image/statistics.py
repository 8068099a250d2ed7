"""Do two Monte-Carlo pictures have the same expectation? Answered from independent runs of each, not by a threshold.

Every run is an unbiased picture, so a statistic of it (a pixel, the mean of a block of pixels, the mean of all) is one
draw of a random number. The difference of the two pictures' mean statistics over its standard error, estimated from the
spread of the runs, is Welch's t (Welch 1947): for equal expectations it follows Student's distribution, whatever
correlations one picture has between its pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]

HALF_EPSILON = 2.0**-11  # largest relative rounding error of a float16 (the raster path's targets)
CHANCE = 1e-6  # probability that a sound pair of pictures fails a test: none in a project's lifetime
PIXEL_TAIL = 1e-3  # two-sided tail beyond which a pixel is called an outlier ...
TAIL_EXCESS = 4.0  # ... and how much more often that may be: runs of few samples are not normal where lights are rare
SPREAD = 1.2  # rms of t over thousands of pixels is 1 within some 5 %; the rest is for pixels far from normal


@dataclass(frozen=True)
class Scores:
    """t of one statistic at every place, channels apart, and the degrees of freedom."""

    t: Array
    freedom: int
    error: Array  # standard error of the difference
    noisy: NDArray[np.bool_]  # places where the runs differ at all: the others agree exactly or not at all

    @property
    def tail(self) -> float:
        """Share of places beyond the two-sided PIXEL_TAIL quantile."""
        return float(np.mean(np.abs(self.t) > stats.t.isf(PIXEL_TAIL / 2, self.freedom)))

    @property
    def spread(self) -> float:
        """Root mean square of t over the noisy places, in units of Student's: 1 for equal expectations."""
        return float(np.sqrt(np.mean(self.t[self.noisy] ** 2) / (self.freedom / (self.freedom - 2.0))))

    @property
    def largest(self) -> float:
        return float(np.abs(self.t).max())

    @property
    def largest_by_chance(self) -> float:
        """What the largest |t| of this many places exceeds with probability CHANCE at most (Bonferroni)."""
        return float(stats.t.isf(CHANCE / 2 / self.t.size, self.freedom))


def scores(a: Array, b: Array, rounding: float = 0.0) -> Scores:
    """Welch's t of runs `a` and `b` (n, ...), where `rounding` is a known relative error of either beside its noise."""
    mean_a, mean_b = a.mean(0), b.mean(0)
    error = np.sqrt(a.var(0, ddof=1) / len(a) + b.var(0, ddof=1) / len(b))
    difference = mean_a - mean_b
    known = rounding * np.maximum(np.abs(mean_a), np.abs(mean_b))
    excess = np.sign(difference) * np.maximum(np.abs(difference) - known, 0.0)
    # A constant pixel has no spread, but its float32 mean rounds.
    floor = np.finfo(np.float32).eps * np.maximum(np.abs(mean_a), 1e-3)
    return Scores(excess / np.maximum(error, floor), min(len(a), len(b)) - 1, error, error > floor)


def block_means(runs: Array, side: int) -> Array:
    """Means (n, h // side, w // side, 3) over square blocks; what is left over at the edges is dropped."""
    n, height, width, channels = runs.shape
    rows, columns = height // side, width // side
    return runs[:, : rows * side, : columns * side].reshape(n, rows, side, columns, side, channels).mean((2, 4))


def assert_same_expectation(a: Array, b: Array, rounding: float = 0.0, block: int = 8) -> None:
    """Runs (n, h, w, 3) of two renderers differ by no more than their noise, in pixels, in blocks and overall."""
    pixels = scores(a, b, rounding)
    assert pixels.tail <= TAIL_EXCESS * PIXEL_TAIL, (
        f"{pixels.tail:.2%} of the pixels lie beyond the {PIXEL_TAIL:.1%} tail of their noise"
    )
    assert pixels.spread <= SPREAD, f"the pixels differ by {pixels.spread:.2f} times their noise"
    noise = np.where(pixels.noisy, pixels.error, np.inf)
    wholes = {
        "a block": (block_means(a, block), block_means(b, block)),
        "the whole picture": (a.mean((1, 2)), b.mean((1, 2))),
        "the picture weighted by its noise": ((a / noise).mean((1, 2)), (b / noise).mean((1, 2))),
    }
    for what, (mine, other) in wholes.items():
        found = scores(mine, other, rounding)
        assert found.largest <= found.largest_by_chance, (
            f"{what} differs systematically: |t| = {found.largest:.1f}, by chance at most {found.largest_by_chance:.1f}"
        )
