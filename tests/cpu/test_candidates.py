"""What is compared, and the Pareto front."""

from __future__ import annotations

import itertools
import math

from hypothesis import given
from hypothesis import strategies as st

from app.measure.candidates import RAYS, RINGS, SAMPLES, candidates, front
from app.settings import Settings

numbers = st.floats(0.0, 10.0) | st.just(math.nan)


def test_candidates_are_distinct_and_as_many_as_asked_for() -> None:
    made = candidates(Settings())
    assert len({c.label for c in made}) == len(made) == 1 + len(RINGS) + len(RAYS) + len(SAMPLES)
    assert all(c.settings.rays.budget <= c.settings.rays.max_per_pixel for c in made)


@given(st.lists(st.tuples(numbers, numbers), max_size=20))
def test_the_front_is_what_nothing_beats(points: list[tuple[float, float]]) -> None:
    kept = front(points)
    chosen = [points[i] for i in kept]
    assert chosen == sorted(chosen)
    assert all(a[1] > b[1] for a, b in itertools.pairwise(chosen))
    for p in points:
        if not any(math.isnan(x) for x in p):
            assert any(q[0] <= p[0] and q[1] <= p[1] for q in chosen), "beaten by none, yet left out"
    for q in chosen:
        assert not any(p != q and p[0] <= q[0] and p[1] <= q[1] for p in points)
