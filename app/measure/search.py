"""A search for the cheapest settings under an error, or for the most accurate ones within some milliseconds.

It knows nothing of pictures: it asks for the figures of one candidate after another. First every view as it is, then
the views in turn, each from cheap to dear as far as dearer ones can still be of use; then, from the best of each view
that is not far off, one knob at a time to the value beside it, until no such step is better. Whoever trades one knob
for another must take two steps of which one alone is worse: where both have been measured, their product says what they
do together, and what promises to be better is tried as well. Nothing is measured twice, and no more than `limit`
candidates are.

Timing is noisy: a step counts if it is better by more than a margin, and of two candidates that differ in one number of
rays, taps or pixels the smaller is the cheaper, whatever was timed. Where the machine's load changes meanwhile, what is
better may be overlooked; what was found is still measured afresh (tune.py).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Container, Generator, Iterable, Iterator, Mapping, Sequence
from itertools import combinations, groupby
from typing import Any

from ..settings import Settings, put, walk
from .candidates import Candidate
from .goal import Figures, Goal, upper_ms

FAR = 2.0  # a view that is worse than the best by this factor is not refined ...
MISSED = 1.5  # ... nor one that misses the limit by this one
GIVE_UP = 1.5  # a candidate that takes this much longer than of use is not drawn to its end
TINY = 1e-30  # instead of a division by zero
PAIRS = 4  # of steps, tried from one place

Key = tuple[str, Settings]
Vary = Callable[[Settings, str, Any], Settings]


class Search:
    """One search. `measured` holds what it has asked for so far."""

    def __init__(
        self,
        goal: Goal,
        first: Sequence[Key],
        coarse: Sequence[Candidate],
        knobs: Mapping[str, Mapping[str, tuple[Any, ...]]],
        limit: int,
        vary: Vary = put,
    ) -> None:
        """`first` has each view as it is; `coarse` has the candidates of each view together, from cheap to dear;
        `knobs` has, by view and dotted path, the values to try, cheapest first; `vary` replaces one of them in
        settings.
        """
        self.goal, self.limit = goal, limit
        self.measured: dict[Key, Figures] = {}
        self._first, self._coarse, self._knobs, self._vary = first, coarse, knobs, vary

    @property
    def best(self) -> Key | None:
        """Of what was measured: the best that keeps the limit, else the closest; None before the first."""
        best = min(self.measured, key=lambda key: self.goal.rank(self.measured[key]), default=None)
        return best and self._least(best)

    def cheaper(self, key: Key) -> Iterator[Key]:
        """What differs from it in one number alone, of rays, taps or pixels, and takes no longer; cheapest first."""
        view, settings = key
        for path, values in self._knobs[view].items():
            now = _value(settings, path)
            if not isinstance(now, bool):  # a step may spare another one
                for value in _ordered(now, values):
                    if value == now:
                        break
                    yield view, self._vary(settings, path, value)

    @property
    def useful_ms(self) -> float:
        """Frames that take longer are of no use: the limit, or those of the best that keeps it; infinite if none."""
        if not self.goal.of_error:
            return self.goal.ms
        return min((f.ms for f in self.measured.values() if self.goal.kept(f)), default=math.inf)

    def run(self) -> Generator[Candidate, Figures, None]:
        """Yields what it wants to know the figures of, and is sent them."""
        for key in self._first:
            yield from self._ask(key)
        views = groupby(((candidate.view, candidate.settings) for candidate in self._coarse), lambda key: key[0])
        turns = deque(iter(list(keys)) for _, keys in views)
        while turns:
            keys = turns.popleft()
            if (yield from self._next_of(keys)):
                turns.append(keys)
        for start in self._starts():
            if self._hopeless(start):
                continue
            here = start
            while (there := (yield from self._step(here)) or (yield from self._exchange(here))) is not None:
                here = there
            if len(self.measured) >= self.limit:
                return

    def _next_of(self, keys: Iterator[Key]) -> Generator[Candidate, Figures, bool]:
        """Measure the next of a view that is not known yet; whether the dearer ones may still be of use."""
        for key in keys:
            known = key in self.measured
            if (figures := (yield from self._ask(key))) is None:
                return False
            if upper_ms(figures) > self.useful_ms or (self.goal.of_error and self.goal.kept(figures)):
                return False  # the dearer ones are dearer still
            if not known:
                return True
        return False

    def _starts(self) -> list[Key]:
        """The best of each view, the best first."""
        ordered = sorted(self.measured, key=lambda key: self.goal.rank(self.measured[key]))
        return [self._least(key) for key in {key[0]: key for key in reversed(ordered)}.values()][::-1]

    def _least(self, key: Key) -> Key:
        """It, or what was measured, keeps the error as well and is certain to be no dearer."""
        kept = [other for other, figures in self.measured.items() if self.goal.kept(figures)]
        return least(key, self.cheaper, kept) if self.goal.of_error and key in kept else key

    def _gains(self, there: Key, here: Key) -> bool:
        """Whether it is better by more than noise; less time for more rays is noise."""
        noise = self.goal.of_error and self.goal.kept(self.measured[here]) and here in self.cheaper(there)
        return not noise and self.goal.better(self.measured[there], self.measured[here])

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
                if figures and self._gains(there, moved or here):
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
        cheaper, dearer = beside(_value(here[1], path), self._knobs[here[0]][path])
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
    values = _ordered(value, values)
    i = values.index(value)
    return values[max(i - 1, 0) : i], values[i + 1 : i + 2]


def _ordered(value: Any, values: Sequence[Any]) -> list[Any]:
    """Values, cheapest first, with a person's own among them."""
    return list(values) if value in values else sorted({*values, value}, reverse=values[0] > values[-1])


def _value(settings: Settings, path: str) -> Any:
    return next(value for p, _, value in walk(settings) if p == path)


def least(key: Key, cheaper: Callable[[Key], Iterable[Key]], among: Container[Key]) -> Key:
    """It, or the cheapest among those that steps to `cheaper` ones lead to."""
    while (below := next((other for other in cheaper(key) if other in among), None)) is not None:
        key = below
    return key


def to_verify(
    goal: Goal,
    found: Mapping[Key, Figures],
    verified: Mapping[Key, Figures],
    cheaper: Callable[[Key], Iterable[Key]] = lambda key: (),
) -> Key | None:
    """Which of those that keep the limit should be measured afresh next: the best, but those last that would miss the
    limit if they did as badly as the worst that was verified. Where an error is to be kept, what is `cheaper` for
    certain goes before what was only timed so.
    """
    slack = max(
        (goal.limited(fresh) / max(goal.limited(found[key]), TINY) for key, fresh in verified.items()), default=1
    )
    left = [key for key, figures in found.items() if key not in verified and goal.kept(figures)]
    roomy = [key for key in left if goal.limited(found[key]) * max(slack, 1) < goal.limit] or left
    best = min(roomy, key=lambda key: goal.rank(found[key]), default=None)
    return least(best, cheaper, roomy) if best and goal.of_error else best


def _product(here: Figures, a: Figures, b: Figures) -> Figures:
    """What two steps do together if each changes time and error by its own factor."""
    return Figures(*(y * z / x if x else math.nan for x, y, z in _figures(here, a, b)))


def _figures(*figures: Figures) -> Iterator[tuple[float, ...]]:
    return zip(*((f.ms, f.high_ms, f.error) for f in figures), strict=True)


def _shown(value: Any) -> str:
    return ("off", "on")[value] if isinstance(value, bool) else f"{value:g}"
