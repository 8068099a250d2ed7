"""A settings leaf and everything that is derived from its one definition: traversal, replacement, text and back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import Field, field, fields, is_dataclass, replace
from enum import Enum
from typing import Any

from .errors import UserError


def knob(
    default: Any,
    low: float | None = None,
    high: float | None = None,
    *,
    unit: str = "",
    doc: str,
    log: bool = False,
    static: bool = False,
    resets: bool = True,
    off: Any = None,
    quality: tuple[Any, ...] = (),
) -> Any:
    """A settings leaf. `static`: compiled in, else a uniform. `resets`: changing it invalidates accumulated samples.
    `off`: the leaf is a step of the technique, and this value switches it off. `quality`: the leaf trades accuracy for
    time, and these values, cheapest first, are worth trying.
    """
    about = {"low": low, "high": high, "unit": unit, "doc": doc, "log": log}
    return field(
        default=default, metadata={**about, "static": static, "resets": resets, "off": off, "quality": quality}
    )


def walk(group: Any, prefix: str = "") -> Iterator[tuple[str, Field[Any], Any]]:
    """Yield (dotted path, field, value) for every leaf: the one traversal that everything derived from settings
    shares.
    """
    for f in fields(group):
        value = getattr(group, f.name)
        if is_dataclass(value):
            yield from walk(value, f"{prefix}{f.name}.")
        else:
            yield f"{prefix}{f.name}", f, value


def put(group: Any, path: str, value: Any) -> Any:
    """A copy of `group` with the leaf at the dotted `path` replaced. Raises UserError for an unknown path."""
    head, dot, rest = path.partition(".")
    if not is_dataclass(group) or head not in {f.name for f in fields(group)}:
        raise UserError(f"there is no setting {path!r}")
    return replace(group, **{head: put(getattr(group, head), rest, value) if dot else value})  # type: ignore[type-var]


def parse(name: str, text: str, leaf: Field[Any]) -> Any:
    """The value that `text` means for a leaf, checked against its range. Raises UserError that calls it by `name`, as
    the user wrote it, and says what is allowed.
    """
    default = leaf.default
    try:
        value = _convert(text, default)
    except (ValueError, KeyError):
        raise UserError(f"{name} {text!r}: give {_expected(default)}") from None
    low, high = leaf.metadata["low"], leaf.metadata["high"]
    for number in value if isinstance(value, tuple) else (value,):
        if low is not None and not low <= number <= high:  # NaN fails as well
            raise UserError(f"{name} {text}: give a value from {low:g} to {high:g}")
    return value


def _convert(text: str, default: Any) -> Any:
    if isinstance(default, bool):
        return {
            "1": True,
            "true": True,
            "on": True,
            "yes": True,
            "0": False,
            "false": False,
            "off": False,
            "no": False,
        }[text.lower()]
    if isinstance(default, Enum):
        return type(default)(text.lower())
    if isinstance(default, tuple):
        numbers = tuple(float(part) for part in text.strip("()[] ").replace(",", " ").split())
        if len(numbers) != len(default):
            raise ValueError(text)
        return numbers
    return type(default)(text)


def _expected(default: Any) -> str:
    if isinstance(default, bool):
        return "on or off"
    if isinstance(default, Enum):
        return "one of " + ", ".join(member.value for member in type(default))
    if isinstance(default, tuple):
        return f"{len(default)} numbers such as " + ",".join(f"{x:g}" for x in default)
    return "a whole number" if isinstance(default, int) else "a number"


def plain(value: Any) -> Any:
    """A leaf's value as JSON holds it."""
    return value.value if isinstance(value, Enum) else list(value) if isinstance(value, tuple) else value


def steps(group: Any) -> Iterator[tuple[str, Any]]:
    """Yield (dotted path, the value that switches it off) of the leaves that are steps of the technique."""
    for path, leaf, _ in walk(group):
        if leaf.metadata["off"] is not None:
            yield path, leaf.metadata["off"]


def qualities(group: Any) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield (dotted path, values to try, cheapest first) of the leaves that trade accuracy for time."""
    for path, leaf, _ in walk(group):
        if leaf.metadata["quality"]:
            yield path, leaf.metadata["quality"]
