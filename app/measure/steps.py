"""Measurements are drawn a frame at a time, as generators; this runs one to its end."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TypeVar

Told = TypeVar("Told")
Result = TypeVar("Result")


def driven(steps: Generator[Told, None, Result], tell: Callable[[Told], object] | None = None) -> Result:
    """What it returns; `tell` hears whatever it yields on the way."""
    while True:
        try:
            told = next(steps)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]
        if tell:
            tell(told)
