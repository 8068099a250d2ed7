"""How far a benchmark is and how long it has to go: a bar on a terminal, a line per run elsewhere."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Sequence
from typing import TextIO

from .bench import ALLOWANCE_S, FEW, Effort, checkpoints, frames_to_time, sample_stops
from .candidates import Candidate

REFERENCE, SERIES = "reference", "traced series"  # what is done once for all candidates of a scene

# Guesses, of which only the ratios matter once something was measured: seconds of a frame of 640x360 pixels on two
# processor cores, and of one evaluation of FLIP there.
SHARP_S, POST_S, RING_S, HYBRID_S, RAY_S, SAMPLE_S = 0.08, 0.13, 0.03, 0.4, 0.06, 0.4
ERRORS_S = 0.4
BAR = 24  # characters


def guessed_s(what: str | Candidate, effort: Effort) -> float:
    """Seconds that a part of the benchmark takes, by the guesses above."""
    pixels = effort.size[0] * effort.size[1] / (640 * 360)
    reads = len(checkpoints(effort.frames))
    if what == REFERENCE:
        return pixels * effort.spp * 1.5 * SHARP_S
    if what == SERIES:
        stops = sample_stops(effort)
        return pixels * (max(stops) * SAMPLE_S + len(stops) * ERRORS_S)
    assert isinstance(what, Candidate)
    traced = what.view == "traced"
    frame_s = pixels * {
        "sharp": SHARP_S,
        "post": POST_S + RING_S * what.settings.post.rings,
        "hybrid": HYBRID_S + RAY_S * what.settings.rays.budget,
        "traced": SAMPLE_S * what.settings.rays.samples_per_frame,
    }.get(what.view, SHARP_S)
    count = frames_to_time(frame_s, effort.timed)
    passes = FEW if frame_s < ALLOWANCE_S / 2 else 0
    drawn = 0.0 if traced else effort.frames * frame_s + pixels * reads * ERRORS_S
    return drawn + (count + passes) * frame_s


class Bar:
    """Tells of parts with a guessed time each; what they took corrects the guess for the rest."""

    def __init__(self, guesses: Sequence[float], stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._ahead, self._count = sum(guesses), len(guesses)
        self._done, self._guessed, self._spent = 0, 0.0, 0.0
        self._stream, self._clock, self._terminal = stream, clock, stream.isatty()
        self._begun = clock()
        self._text, self._guess, self._open = "", 0.0, False

    def begin(self, text: str, guess: float) -> None:
        """A part begins."""
        self._text, self._guess, self._begun = text, guess, self._clock()
        self.show("", 0.0)

    def show(self, what: str, fraction: float) -> None:
        """Somewhere inside a part."""
        if self._terminal:
            done = (self._guessed + fraction * self._guess) / max(self._guessed + self._ahead, 1e-9)
            filled = round(BAR * min(done, 1.0))
            bar = "█" * filled + "·" * (BAR - filled)
            inside = "" if what in self._text else f": {what}"
            line = f"{bar} {100 * done:3.0f} %, {self.left(fraction)}; {self._text}{inside}"
            self._stream.write(f"\r\x1b[K{line[: shutil.get_terminal_size().columns - 1]}")
            self._stream.flush()
            self._open = True

    def end(self) -> None:
        """The part is done."""
        took = self._clock() - self._begun
        self._done += 1
        self._ahead = max(self._ahead - self._guess, 0.0)
        self._guessed += self._guess
        self._spent += took
        self._guess = 0.0
        if self._terminal:
            self.show("", 0.0)
        else:
            line = f"[{self._done}/{self._count}] {self._text}: {took:.1f} s"
            self._stream.write(f"{line}; {self.left()}\n" if self._done < self._count else f"{line}\n")
            self._stream.flush()

    def close(self) -> None:
        """Leave the line, that others may write."""
        if self._open:
            self._stream.write("\n")
            self._open = False

    def left(self, fraction: float = 0.0) -> str:
        """The time to go, in words."""
        # The first parts are unlike the rest and must not decide alone: the guess counts like a tenth of all parts.
        trust = 0.1 * (self._guessed + self._ahead)
        ahead = self._ahead - fraction * self._guess
        seconds = ahead * (self._spent + trust) / max(self._guessed + trust, 1e-9)
        return f"about {duration(seconds)} left"


def duration(seconds: float) -> str:
    """In the unit that one would say."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
