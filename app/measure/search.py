"""A search for the cheapest settings under an error, or for the most accurate ones within some milliseconds.

It knows nothing of pictures: it asks for the figures of one candidate after another. First every view from cheap to
dear, as far as dearer ones can still be of use; then, from the best of each view that is not far off, one knob at a
time to the value beside it, until no such step is better. Whoever trades one knob for another must take two steps of
which one alone is worse: where both have been measured, their product says what they do together, and what promises
to be better is tried as well. Nothing is measured twice, and no more than `limit` candidates are.

Timing is noisy: a step counts if it is better by more than a margin. Where the machine's load changes meanwhile, what
is better may be overlooked; what was found is still measured afresh (tune.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby
from typing import Any

from ..settings import Settings, put, walk
from .candidates import Candidate

MS_MARGIN = 0.02  # of the figure: a smaller gain is not to be told from noise ...
ERROR_MARGIN = 0.005  # ... or, where the same seed gives the same error, not worth a step
FAR = 2.0  # a view that is worse than the best by this factor is not refined ...
MISSED = 1.5  # ... nor one that misses the limit by this one
GIVE_UP = 1.5  # a candidate that takes this much longer than of use is not drawn to its end
TINY = 1e-30  # instead of a division by zero
PAIRS = 4  # of steps, tried from one place

Key = tuple[str, Settings]
Vary = Callable[[Settings, str, Any], Settings]


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


class Search:
    """One search. `measured` holds what it has asked for so far."""

    def __init__(
        self,
        goal: Goal,
        coarse: Sequence[Candidate],
        knobs: Mapping[str, Mapping[str, tuple[Any, ...]]],
        limit: int,
        vary: Vary = put,
    ) -> None:
        """`coarse` has the candidates of each view together, from cheap to dear; `knobs` has, by view and dotted path,
        the values to try, cheapest first; `vary` replaces one of them in settings.
        """
        self.goal, self.limit = goal, limit
        self.measured: dict[Key, Figures] = {}
        self._coarse, self._knobs, self._vary = coarse, knobs, vary

    @property
    def best(self) -> Key | None:
        """Of what was measured: the best that keeps the limit, else the closest; None before the first."""
        return min(self.measured, key=lambda key: self.goal.rank(self.measured[key]), default=None)

    @property
    def useful_ms(self) -> float:
        """Frames that take longer are of no use: the limit, or those of the best that keeps it; infinite if none."""
        if not self.goal.of_error:
            return self.goal.ms
        return min((f.ms for f in self.measured.values() if self.goal.kept(f)), default=math.inf)

    def run(self) -> Generator[Candidate, Figures, None]:
        """Yields what it wants to know the figures of, and is sent them."""
        for _, family in groupby(self._coarse, lambda candidate: candidate.view):
            for candidate in family:
                if (figures := (yield from self._ask((candidate.view, candidate.settings)))) is None:
                    return
                if upper_ms(figures) > self.useful_ms or (self.goal.of_error and self.goal.kept(figures)):
                    break  # the dearer ones are dearer still
        for start in self._starts():
            if self._hopeless(start):
                continue
            here = start
            while (there := (yield from self._step(here)) or (yield from self._exchange(here))) is not None:
                here = there
            if len(self.measured) >= self.limit:
                return

    def _starts(self) -> list[Key]:
        """The best of each view, the best first."""
        ordered = sorted(self.measured, key=lambda key: self.goal.rank(self.measured[key]))
        return list({key[0]: key for key in reversed(ordered)}.values())[::-1]

    def _hopeless(self, key: Key) -> bool:
        best = self.best
        assert best is not None
        a, b = self.goal.rank(self.measured[key]), self.goal.rank(self.measured[best])
        missed = a[0] and a[1] > MISSED * self.goal.limit
        return key != best and (missed or (a[0] == b[0] and a[1] > FAR * b[1]))

    def _step(self, here: Key) -> Generator[Candidate, Figures, Key | None]:
        """Where one knob at a time leads, each as soon as it is better; None: nowhere."""
        moved = None
        for path in self._knobs[here[0]]:
            for there in self._beside(moved or here, path):
                figures = yield from self._ask(there)
                if figures and self.goal.better(figures, self.measured[moved or here]):
                    moved = there
                    break
        return moved

    def _exchange(self, here: Key) -> Generator[Candidate, Figures, Key | None]:
        """The first better place of those that two steps together promise to be better, the most promising first."""
        for there in self._promising(here):
            figures = yield from self._ask(there)
            if figures and self.goal.better(figures, self.measured[here]):
                return there
        return None

    def _promising(self, here: Key) -> list[Key]:
        view, settings = here
        now = self.measured[here]
        steps = [
            (path, value, self.measured[there])
            for path in self._knobs[view]
            for there, value in zip(self._beside(here, path), self._values_beside(here, path), strict=True)
            if there in self.measured
        ]
        found: dict[Key, Figures] = {}
        for (path_a, value_a, a), (path_b, value_b, b) in combinations(steps, 2):
            if path_a != path_b:
                there = view, self._vary(self._vary(settings, path_a, value_a), path_b, value_b)
                found[there] = _product(now, a, b)
        better = [key for key in found if key not in self.measured and self.goal.better(found[key], now)]
        return sorted(better, key=lambda key: self.goal.rank(found[key]))[:PAIRS]

    def _beside(self, here: Key, path: str) -> list[Key]:
        view, settings = here
        return [(view, self._vary(settings, path, value)) for value in self._values_beside(here, path)]

    def _values_beside(self, here: Key, path: str) -> list[Any]:
        """The next cheaper and the next dearer value of a knob, what may help first."""
        value = next(v for p, _, v in walk(here[1]) if p == path)
        cheaper, dearer = beside(value, self._knobs[here[0]][path])
        save = self.goal.of_error == self.goal.kept(self.measured[here])
        return [*cheaper, *dearer] if save else [*dearer, *cheaper]

    def candidate(self, key: Key) -> Candidate:
        """With a label that says which knobs are not at their defaults."""
        view, settings = key
        changed = [
            f"{path} {_shown(value)}"
            for path, leaf, value in walk(settings)
            if path in self._knobs[view] and value != leaf.default
        ]
        return Candidate(", ".join([view, *changed]), view, settings)

    def _ask(self, key: Key) -> Generator[Candidate, Figures, Figures | None]:
        """Its figures, measured now or before; None where the limit forbids to measure."""
        if key not in self.measured:
            if len(self.measured) >= self.limit:
                return None
            self.measured[key] = yield self.candidate(key)
        return self.measured[key]


def beside(value: Any, values: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """The next cheaper of some values, cheapest first, and the next dearer: none at an end."""
    if value not in values:  # a person's own
        values = sorted({*values, value}, reverse=values[0] > values[-1])
    i = list(values).index(value)
    return list(values[max(i - 1, 0) : i]), list(values[i + 1 : i + 2])


def to_verify(goal: Goal, found: Mapping[Key, Figures], verified: Mapping[Key, Figures]) -> Key | None:
    """Which of those that keep the limit should be measured afresh next: the best, but those last that would miss the
    limit if they did as badly as the worst that was verified.
    """
    slack = max(
        (goal.limited(fresh) / max(goal.limited(found[key]), TINY) for key, fresh in verified.items()), default=1
    )
    left = (key for key, figures in found.items() if key not in verified and goal.kept(figures))
    return min(
        left,
        key=lambda key: (goal.limited(found[key]) * max(slack, 1) >= goal.limit, goal.rank(found[key])),
        default=None,
    )


def worse(figures: Iterable[Figures]) -> Figures:
    """The worst of each figure; NaN where one is."""
    return Figures(*(_most(values) for values in zip(*((f.ms, f.high_ms, f.error) for f in figures), strict=True)))


def _most(values: Iterable[float]) -> float:
    values = list(values)
    return math.nan if any(map(math.isnan, values)) else max(values)


def _product(here: Figures, a: Figures, b: Figures) -> Figures:
    """What two steps do together if each changes time and error by its own factor."""
    return Figures(*(y * z / x if x else math.nan for x, y, z in _figures(here, a, b)))


def _figures(*figures: Figures) -> Iterator[tuple[float, ...]]:
    return zip(*((f.ms, f.high_ms, f.error) for f in figures), strict=True)


def _shown(value: Any) -> str:
    return ("off", "on")[value] if isinstance(value, bool) else f"{value:g}"
