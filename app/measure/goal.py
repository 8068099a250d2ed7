"""What advice is measured by: a candidate's figures, and a limit on one of them while the other is made small."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

MS_MARGIN = 0.02  # of the figure: a smaller gain is not to be told from noise ...
ERROR_MARGIN = 0.005  # ... or, where the same seed gives the same error, not worth a step


@dataclass(frozen=True)
class Figures:
    """Of a candidate."""

    ms: float  # median of a frame
    high_ms: float  # upper end of its confidence interval; NaN: too few frames
    error: float  # NaN: given up before it was known


@dataclass(frozen=True)
class Goal:
    """An error to stay below, or milliseconds: one of the two."""

    error: float = math.nan
    ms: float = math.nan
    floor: float = 0.0  # errors below it mean nothing (app/measure/reference.py)

    @property
    def of_error(self) -> bool:
        return not math.isnan(self.error)

    @property
    def limit(self) -> float:
        return self.error if self.of_error else self.ms

    def limited(self, figures: Figures) -> float:
        """What must stay below the limit; infinite where unknown."""
        value = self.error_of(figures) if self.of_error else upper_ms(figures)
        return math.inf if math.isnan(value) else value

    def sought(self, figures: Figures) -> float:
        """What should then be as small as possible; infinite where unknown."""
        value = figures.ms if self.of_error else self.error_of(figures)
        return math.inf if math.isnan(value) else value

    def error_of(self, figures: Figures) -> float:
        """The error, or the floor where that is above it; NaN where unknown."""
        return figures.error if math.isnan(figures.error) else max(figures.error, self.floor)

    def kept(self, figures: Figures) -> bool:
        return self.limited(figures) < self.limit and math.isfinite(self.sought(figures))

    def rank(self, figures: Figures) -> tuple[bool, float, float]:
        """Smaller is better: what keeps the limit before what misses it by least."""
        kept, limited, sought = self.kept(figures), self.limited(figures), self.sought(figures)
        return (False, sought, limited) if kept else (True, limited, sought)

    def better(self, a: Figures, b: Figures) -> bool:
        """Whether `a` is better than `b` by more than noise."""
        if self.kept(a) != self.kept(b):
            return self.kept(a)
        of_ms = self.of_error == self.kept(a)  # kept: what is sought counts, else what is limited
        return self.rank(a)[1] < (1.0 - (MS_MARGIN if of_ms else ERROR_MARGIN)) * self.rank(b)[1]


def upper_ms(figures: Figures) -> float:
    """The upper end of the median's interval, or the median where there are too few frames for one."""
    return figures.ms if math.isnan(figures.high_ms) else figures.high_ms


def worse(figures: Iterable[Figures]) -> Figures:
    """The worst of each figure; NaN where one is."""
    return Figures(*(_most(values) for values in zip(*((f.ms, f.high_ms, f.error) for f in figures), strict=True)))


def _most(values: Iterable[float]) -> float:
    values = list(values)
    return math.nan if any(map(math.isnan, values)) else max(values)
