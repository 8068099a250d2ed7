"""Edge values of float32, tables of them for every argument of a function, and what counts as the right answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

EPS = 2.0**-23  # an ulp of 1; one correctly rounded operation errs by half of it
TINY = 2.0**-126  # the smallest normal number: below it, results and arguments may count as zero
OPEN = 2.0**-11  # what sine, cosine and arctangent may err by: GLSL leaves it open, desktop drivers keep this
ROWS = 4000  # of a table at the most
RANDOM = 24  # random values beside the edges of a column

Column = np.ndarray | Sequence[float] | float
Argument = Column | tuple[Column, ...]  # one column, of numbers (n,) or vectors (n, k); or one for each component

_DENORMAL = 2.0**-149, 1e-40, np.nextafter(np.float32(TINY), np.float32(0))
_AROUND_ONE = 1.0 - EPS / 2, 1.0, 1.0 + EPS
_MAGNITUDES = (
    *(0.0, *_DENORMAL, TINY, 1e-30, 1e-18, 1e-9, EPS / 2, EPS, 0.1, 0.5, *_AROUND_ONE, 1.5, 2.0, 3.0),
    *(math.pi * k / 4 for k in (1, 2, 3, 4, 6, 8)),
    *(16.0, 255.0, 1024.0, 65504.0, 2.0**24, 1e9, 1e18, 1e30, float(np.finfo(np.float32).max)),
)


def edges(low: float, high: float, *more: float, seed: int = 0) -> np.ndarray:
    """float32 values of [low, high]: its ends, their neighbours, what float32 has of edges in it, and random ones,
    evenly over the exponents. `more` are added, whatever the range.
    """
    rng = np.random.default_rng(seed)
    ends = np.array([low, high], np.float32)
    inside = np.nextafter(ends, ends[::-1])
    largest = max(abs(low), abs(high))
    spread = largest * 2.0 ** -rng.uniform(0.0, min(24.0, 40.0 + np.log2(max(largest, TINY))), RANDOM)
    values = np.array([*_MAGNITUDES, *spread, *rng.uniform(low, high, RANDOM)], np.float32)
    values = np.concatenate([values, -values, ends, inside])
    values = values[(values >= ends[0]) & (values <= ends[1])]
    return np.concatenate([np.unique(values), [np.float32(-0.0)] * (low <= 0.0 <= high), np.array(more, np.float32)])


def integers(low: int, high: int, *more: int) -> np.ndarray:
    """The ends of a range of whole numbers, their neighbours, powers of two and their neighbours, and random ones."""
    powers = [2**k + d for k in range(33) for d in (-1, 0, 1)]
    drawn = np.random.default_rng(1).integers(low, high, RANDOM, endpoint=True).tolist()
    return np.array(sorted({n for n in (low, low + 1, high - 1, high, *powers, *drawn) if low <= n <= high} | {*more}))


def table(*arguments: Argument) -> list[np.ndarray]:
    """Arguments of up to ROWS calls: all combinations of the columns' values if there are that few, else random ones
    in which every value of each column occurs.
    """
    columns = [np.atleast_1d(np.asarray(column)) for a in arguments for column in (a if isinstance(a, tuple) else (a,))]
    if math.prod(len(column) for column in columns) <= ROWS:
        picks = [grid.ravel() for grid in np.meshgrid(*(np.arange(len(c)) for c in columns), indexing="ij")]
    else:
        rng = np.random.default_rng(2)
        picks = [rng.permutation(np.resize(np.arange(len(c)), ROWS)) for c in columns]
    taken = iter(column[pick] for column, pick in zip(columns, picks, strict=True))
    return [np.stack([next(taken) for _ in a], -1) if isinstance(a, tuple) else next(taken) for a in arguments]


def rowwise(function: Callable[..., Any]) -> Callable[..., np.ndarray]:
    """A twin of single numbers, or of settings that are single numbers, over rows of arguments."""

    def over_rows(*arguments: np.ndarray) -> np.ndarray:
        plain = [a.tolist() if a.ndim == 1 else list(a) for a in arguments]
        return np.array([function(*row) for row in zip(*plain, strict=True)])

    return over_rows


def exactly(*arguments: np.ndarray) -> float:
    """The error bound of what does not round."""
    return 0.0


def ulps(count: float) -> Callable[..., float]:
    """The error bound `count` ulps of 1: of sums, products and quotients that stay below about 1."""
    return lambda *arguments: count * EPS


@dataclass(frozen=True)
class Case:
    """A function of glsl/lib, its twin and where to compare them.

    `error` gives the largest error (absolute, broadcast to the result's shape) from the arguments in float64; of a
    bool or whole number, where it may be off by how many. `relative` adds that many ulps of the exact value itself.
    `extra` is GLSL for a wrapper that `signature` then calls, around functions with out parameters.
    """

    signature: str
    twin: Callable[..., Any]
    arguments: tuple[Argument, ...]
    error: Callable[..., Any] = exactly
    relative: float = 0.0
    extra: str = ""


def wrong(case: Case, rows: list[np.ndarray], got: np.ndarray) -> np.ndarray:
    """Which rows (n,) of what the GPU answered are none of the right answers.

    Denormal numbers may be taken for zero, as llvmpipe and most GPUs do: what is right for either is right. Beyond
    float32's range stands infinity.
    """
    flushed = [np.where(np.abs(r) < TINY, np.copysign(0.0, r), r) if r.dtype.kind == "f" else r for r in rows]
    right = np.zeros(got.shape, bool)
    for arguments in (rows, flushed):
        values = [a.astype(np.float64) if a.dtype.kind == "f" else a for a in arguments]
        with np.errstate(all="ignore"):
            exact = np.asarray(case.twin(*values), np.float64)
            bound = np.asarray(case.error(*values), np.float64)
            held = exact.astype(np.float32).astype(np.float64)
            room = bound + case.relative * EPS * np.abs(exact) + (TINY if got.dtype.kind == "f" else 0.0)
            same = (held == got) | (np.isnan(held) & np.isnan(got))
            right |= same | (np.abs(got.astype(np.float64) - exact) <= room)
    return ~right.reshape(len(got), -1).all(1)
