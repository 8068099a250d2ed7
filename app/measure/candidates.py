"""What is compared: every view at several settings, from cheap to dear, and which of them are worth having."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..settings import Settings, put

RINGS = (2, 3, 4, 6, 8)  # of the post-process' gather
RAYS = (1, 2, 4, 8, 16)  # hybrid: mean rays per masked pixel and frame
SAMPLES = (1, 2, 4, 8, 16, 32, 64)  # traced: lens samples per pixel and frame


@dataclass(frozen=True)
class Candidate:
    """A way to draw the picture."""

    label: str  # unique among those compared
    view: str
    settings: Settings


def candidates(
    settings: Settings,
    rings: Sequence[int] = RINGS,
    rays: Sequence[float] = RAYS,
    samples: Sequence[int] = SAMPLES,
) -> list[Candidate]:
    """All of them, `settings` deciding whatever is not varied."""
    return [
        Candidate("sharp", "sharp", settings),
        *(Candidate(f"post, {n} rings", "post", put(settings, "post.rings", n)) for n in rings),
        *(_hybrid(settings, n) for n in rays),
        *(Candidate(f"traced, {n} spp", "traced", put(settings, "rays.samples_per_frame", n)) for n in samples),
    ]


def _hybrid(settings: Settings, rays: float) -> Candidate:
    unit = "ray" if rays == 1 else "rays"
    return Candidate(f"hybrid, {rays:g} {unit}", "hybrid", with_budget(settings, rays))


def with_budget(settings: Settings, rays: float) -> Settings:
    """With so many rays per masked pixel, and room for the pixels that need more than the mean."""
    most = max(settings.rays.max_per_pixel, round(4 * rays))
    return put(put(settings, "rays.budget", float(rays)), "rays.max_per_pixel", most)  # type: ignore[no-any-return]


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices of the (cost, error) pairs that no other one beats in both, cheapest first: the Pareto front. Of equal
    pairs the first stays; a pair with a NaN is never on it.
    """
    best, kept = float("inf"), []
    for i in sorted((i for i, p in enumerate(points) if p[0] == p[0] and p[1] == p[1]), key=lambda i: points[i]):
        if points[i][1] < best:
            best = points[i][1]
            kept.append(i)
    return kept
