"""How errors are spoken of: which figures there are, never better than the reference knows, and what one buys."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .candidates import front
from .metrics import Errors

CLEARLY = 0.01  # of an error: a smaller difference is not worth a word


@dataclass(frozen=True)
class Metric:
    """A figure that errors are compared by."""

    title: str
    unit: str
    power: float = 1.0  # of the error it grows with; 0: it falls with the error's logarithm, in decibels

    @property
    def rises(self) -> bool:
        """Whether more is better."""
        return self.power == 0.0


METRICS: Mapping[str, Metric] = {
    "rmse": Metric("RMSE", "linear light"),
    "relative_mse": Metric("relative MSE", "no unit", 2.0),
    "psnr": Metric("PSNR", "dB", 0.0),
    "flip": Metric("FLIP", "0 to 1"),
}


@dataclass(frozen=True)
class Priced:
    """What one way to draw the picture costs and how wrong it is."""

    label: str
    ms: float
    figure: float
    at_floor: bool = False  # no better than the reference: its error is at most this


def quoted(errors: Errors, floor: Errors, metric: str) -> tuple[float, bool]:
    """The figure by this metric, and whether it is the reference's noise because the picture's is no more than that."""
    figure, noise = (float(getattr(e, metric)) for e in (errors, floor))
    better = figure >= noise if METRICS[metric].rises else figure <= noise
    return (noise, True) if better else (figure, False)


def badness(figure: float, metric: str) -> float:
    """A number that is smaller for a better figure."""
    return -figure if METRICS[metric].rises else figure


def best(points: Sequence[Priced], metric: str) -> list[Priced]:
    """Those that no other one beats in both time and figure, cheapest first."""
    return [points[i] for i in front([(p.ms, badness(p.figure, metric)) for p in points])]


def independent(first: float, frames: float, metric: str) -> float:
    """The figure that averaging independent frames leads to after `frames` times as many as gave `first`: the error
    falls with the square root of their number.
    """
    power = METRICS[metric].power
    return first * frames ** (-0.5 * power) if power else first + 10.0 * math.log10(frames)


def clearly_better(figure: float, than: float, metric: str) -> bool:
    """Whether the error is smaller by CLEARLY or more."""
    if METRICS[metric].rises:
        return figure - than > -20.0 * math.log10(1.0 - CLEARLY)
    return figure < than * (1.0 - CLEARLY) ** METRICS[metric].power


def worth(now: Priced, points: Sequence[Priced], metric: str) -> tuple[Priced | None, Priced | None]:
    """(the cheapest that is better, the best that is cheaper) than what is shown now, of those worth having."""
    kept = best(points, metric)
    better = [p for p in kept if clearly_better(p.figure, now.figure, metric)]
    cheaper = [p for p in kept if p.ms < now.ms]
    return (better[0] if better else None), (cheaper[-1] if cheaper else None)
