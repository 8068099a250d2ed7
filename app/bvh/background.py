"""One long computation beside the window: a thread that tells how far it is, can be left, and keeps what it raised.

numpy lets other threads run during its larger operations, so frames go on meanwhile. No OpenGL in there: a context
belongs to one thread.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from .build import Progress

T = TypeVar("T")
POLL_S = 0.05  # between two looks of one who waits: it tells progress and may be interrupted
LEAVE_S = 0.5  # longest wait for the thread to notice that nobody wants its result: it dies with the program anyway


class _Left(Exception):
    """Raised inside the thread to end it."""


class Background(Generic[T]):
    """Begins `work(progress)` at once. `what` is being done until it tells otherwise."""

    def __init__(self, what: str, work: Callable[[Progress], T]) -> None:
        self._work = work
        self._left = threading.Event()
        self._made: list[T] = []
        self._error: Exception | None = None
        self.progress = (what, 0.0)  # what is being done, and the part that is
        self._thread = threading.Thread(target=self._run, name="background", daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether `result` answers at once."""
        return not self._thread.is_alive()

    def wait(self, progress: Progress | None = None) -> None:
        """Return once it is done, and tell how far it is until then."""
        while not self.done:
            self._thread.join(POLL_S)
            if progress is not None:
                progress(*self.progress)

    def result(self) -> T:
        """What it made. Waits for it; raises what the work raised."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._made[0]

    def leave(self) -> None:
        """Nobody wants the result any more: end at the next step of its progress."""
        self._left.set()
        self._thread.join(LEAVE_S)

    def _run(self) -> None:
        try:
            self._made.append(self._work(self._tell))
        except Exception as error:
            self._error = error

    def _tell(self, what: str, part: float) -> None:
        self.progress = (what, part)
        if self._left.is_set():
            raise _Left
