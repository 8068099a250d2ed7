"""Tables in Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence

NOTHING = "–"  # what was not measured, or does not exist


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def number(value: float | None, form: str) -> str:
    """A number in a format such as ".4f" or ".1%"; None, infinities and what is not a number are NOTHING."""
    return NOTHING if value is None or not math.isfinite(value) else format(value, form)


def ratio(value: float, base: float) -> str:
    """A quotient; NOTHING where there is none."""
    return number(value / base if base else math.nan, ".2f")
