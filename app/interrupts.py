"""Ctrl-C: one line and the exit code that shells report for it, whenever it comes."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from .errors import tell

INTERRUPTED = 130  # what shells report for Ctrl-C


def interrupted() -> int:
    """Say so, and let no second Ctrl-C disturb the end of the program; the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tell("interrupted")
    return INTERRUPTED


@contextmanager
def held_back() -> Iterator[None]:
    """Keep Ctrl-C until the end of a block that would take it for a failure of its own and go on."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN or threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt
