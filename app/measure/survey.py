"""What accuracy costs, for one picture: the error and milliseconds of every candidate, measured a slice at a time.

The pictures are small, so that a slice is short; errors and milliseconds are of that size. A slice is one frame, or a
few rows of a traced one. The reference comes first, then the view that is on screen, then the others from cheap to
dear, at last how the error of the view on screen falls from frame to frame. What stays valid is kept.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..frame.pipeline import VIEWS
from ..gpu.context import Context
from ..gpu.timing import GPU_TIMER
from ..renderer import Renderer
from ..settings import Settings
from .candidates import SAMPLES, Candidate, candidates
from .metrics import Errors, has_flip, squared_errors
from .reference import Reference, drawing
from .subject import Key, Subject, key_of, plainly, unvaried
from .timing import frame_sums

FRAMES = 16  # of a picture that stands still, after which it is judged: as in the README's table
WARM_UP = 4  # of them not timed: programs are compiled, targets made
POINTS = 128  # lens points of the reference: a second or two of small frames
CURVE_FRAMES = 128  # of the view on screen, for its convergence
SLICE_MS = 40.0  # of a traced frame's rows, where the GPU has no timer that could add slices up
DEAR_SAMPLES = 4  # traced samples a frame above which a candidate takes seconds on a software rasteriser
FLOOR_KEY = ("floor",)
OWN = "now"  # the label of the view on screen


@dataclass(frozen=True)
class Measured:
    """One way to draw the picture, after FRAMES frames."""

    ms: float  # median of a frame
    errors: Mapping[str, Errors]  # by region, the whole first
    picture: NDArray[np.float32]  # (h, w, 3) linear radiance
    difference: NDArray[np.float32]  # (h, w) root mean square of the displayed channels' difference, 0 to 1


@dataclass(frozen=True)
class Findings:
    """All that is known so far."""

    size: tuple[int, int] = (0, 0)
    points: tuple[tuple[Candidate, Measured | None], ...] = ()
    own: tuple[Candidate, Measured | None] | None = None  # the view on screen; None: it shows a target
    floor: Mapping[str, Errors] | None = None  # the reference's noise, by region
    curve: tuple[tuple[int, Mapping[str, Errors]], ...] = ()  # errors of the view on screen after so many frames
    doing: str = ""  # nothing: all is measured
    part: float = 0.0  # of all frames that has been drawn

    @property
    def measured(self) -> int:
        return sum(found is not None for _, found in self.points)


@dataclass
class _Work:
    """What is being drawn."""

    key: Key
    title: str
    slices: Generator[float, None, None]  # each step draws one and yields the part of the work that is done
    part: float = 0.0


@dataclass
class Survey:
    """Measures with a renderer of its own. `aim` says at what, `step` draws a slice."""

    ctx: Context
    renderer: Renderer
    clock: Callable[[], float] = time.perf_counter
    _subject: Subject | None = None
    _base: Settings = field(default_factory=Settings)
    _own: tuple[Key, Candidate] | None = None
    _listed: list[tuple[Key, Candidate]] = field(default_factory=list)
    _wanted: set[Key] = field(default_factory=set)  # the keys of all work, done or not
    _reference: Reference | None = None
    _floor: Mapping[str, Errors] | None = None
    _found: dict[Key, Measured] = field(default_factory=dict)
    _flipped: set[Key] = field(default_factory=set)  # of what was found, that which has its FLIP
    _curve: list[tuple[int, Mapping[str, Errors]]] = field(default_factory=list)
    _curve_key: Key = ()
    _work: _Work | None = None

    def aim(self, subject: Subject) -> None:
        """Measure this from now on; what was found for another picture is dropped."""
        before, self._subject = self._subject, subject
        if subject == before:
            return
        if before is None or subject.truth_key != before.truth_key:
            self._stop()
            self._reference = self._floor = None
            self._found.clear()
            self._flipped.clear()
            self._curve.clear()
        if before is None or unvaried(subject.settings) != unvaried(self._base):
            self._base = subject.settings
        self._list(subject)
        if self._curve_key != (self._own and self._own[0]):
            self._curve.clear()
        if self._work and self._work.key not in self._wanted:
            self._stop()

    def step(self) -> bool:
        """Draw one slice, and wait for it. False: all is measured."""
        if self._work is None:
            self._work = self._next()
        if self._work is None:
            return False
        try:
            self._work.part = next(self._work.slices)
        except StopIteration:
            self._work = None
        return True

    @property
    def done(self) -> bool:
        return self._work is None and self._next() is None

    def findings(self) -> Findings:
        """What is known now."""
        if self._subject is None:
            return Findings()
        work = self._work or self._next()
        done = sum(self._has(key) for key in self._wanted)
        return Findings(
            self._subject.size,
            tuple((c, self._found.get(key)) for key, c in self._listed),
            (self._own[1], self._found.get(self._own[0])) if self._own else None,
            self._floor,
            tuple(self._curve),
            work.title if work else "",
            (done + work.part) / len(self._wanted) if work else 1.0,
        )

    def _list(self, subject: Subject) -> None:
        """Note what is to be measured of it."""
        samples = [n for n in SAMPLES if subject.dear or n <= DEAR_SAMPLES]
        own = Candidate(OWN, subject.view, subject.settings)
        self._own = (key_of(own), own) if subject.view in VIEWS else None
        self._listed = [(key_of(c), c) for c in candidates(self._base, samples=samples)]
        of_own = (self._own[0], ("curve", *self._own[0])) if self._own else ()
        self._wanted = {("reference",), *of_own, *(key for key, _ in self._listed)}
        if subject.flip and has_flip():
            pictures = (FLOOR_KEY, *((self._own[0],) if self._own else ()), *(key for key, _ in self._listed))
            self._wanted |= {("flip", *key) for key in pictures}

    def _has(self, key: Key) -> bool:
        """Whether a piece of work is done."""
        if key == ("reference",):
            return self._reference is not None
        if key[0] == "flip":
            return key in self._flipped
        return self._converged if key[0] == "curve" else key in self._found

    @property
    def _converged(self) -> bool:
        return bool(self._curve) and self._curve[-1][0] >= CURVE_FRAMES

    def _stop(self) -> None:
        """Leave what is being drawn."""
        if self._work:
            self._work.slices.close()
            self._work = None

    def _next(self) -> _Work | None:
        """What to do next; nothing is drawn before the first slice is asked for."""
        subject = self._subject
        if subject is None:
            return None
        if self._reference is None:
            return _Work(("reference",), "the reference", self._refer(subject))
        if (key := ("flip", *FLOOR_KEY)) in self._wanted and not self._has(key):
            return _Work(key, "FLIP of the reference", self._flip(key, self._reference))
        for key, candidate in (*((self._own,) if self._own else ()), *self._listed):
            if key not in self._found:
                title = f"{candidate.view} as it is now" if candidate.label == OWN else candidate.label
                return _Work(key, title, self._measure(candidate, subject, self._reference))
            if (flip := ("flip", *key)) in self._wanted and not self._has(flip):
                return _Work(flip, f"FLIP of {candidate.label}", self._flip(flip, self._reference))
        if self._own and not self._converged:
            key, own = self._own
            return _Work(("curve", *key), "convergence", self._converge(own, subject, self._reference))
        return None

    def _refer(self, subject: Subject) -> Generator[float, None, None]:
        self.renderer.resize(subject.size)
        steps = drawing(self.renderer, subject.camera, plainly(subject.settings), POINTS, time_s=subject.time_s)
        while True:
            try:
                done = next(steps)
            except StopIteration as end:
                self._reference = end.value
                self._floor = end.value.errors(end.value.halves[0], flip=False)
                return
            self.ctx.finish()
            yield done

    def _measure(self, candidate: Candidate, subject: Subject, truth: Reference) -> Generator[float, None, None]:
        profiler = self.renderer.profiler
        wall_ms: list[float] = []
        by_query = profiler.source == GPU_TIMER
        frames = self._frames(candidate, subject, by_query)
        while len(wall_ms) < FRAMES:
            if (ms := next(frames)) is not None:
                wall_ms.append(ms)
                if len(wall_ms) == WARM_UP:
                    profiler.keep(FRAMES)
            if len(wall_ms) < FRAMES:
                yield len(wall_ms) / FRAMES
        profiler.flush()
        timed = frame_sums(profiler.samples_ms()) if by_query else wall_ms[WARM_UP:]
        picture = self.renderer.linear()
        difference = np.sqrt(squared_errors(picture, truth.picture)[2]).astype(np.float32)
        errors = truth.errors(picture, flip=False)
        self._found[key_of(candidate)] = Measured(float(np.median(timed)), errors, picture, difference)

    def _flip(self, key: Key, truth: Reference) -> Generator[float, None, None]:
        """Add FLIP to what was measured: one slice, longer than others."""
        yield 0.0
        if key[1:] == FLOOR_KEY:
            self._floor = truth.floor
        else:
            found = self._found[key[1:]]
            self._found[key[1:]] = replace(found, errors=truth.errors(found.picture))
        self._flipped.add(key)

    def _converge(self, own: Candidate, subject: Subject, truth: Reference) -> Generator[float, None, None]:
        """Measure at frame numbers that are some 12 % apart: as many as a logarithmic axis can tell apart."""
        self._curve.clear()
        self._curve_key = key_of(own)
        number, due = 0, 1
        for ms in self._frames(own, subject, by_query=False):
            number += ms is not None
            if number == due:
                self._curve.append((number, truth.errors(self.renderer.linear(), flip=False)))
                if number >= CURVE_FRAMES:
                    return
                due = min(max(number + 1, math.ceil(number * 1.12)), CURVE_FRAMES)
            yield number / CURVE_FRAMES

    def _frames(self, candidate: Candidate, subject: Subject, by_query: bool) -> Iterator[float | None]:
        """Draw a candidate from a fresh start without end, a slice at a time: each frame's wall-clock ms, None for a
        slice that does not complete one.
        """
        renderer, settings = self.renderer, plainly(candidate.settings)
        renderer.resize(subject.size)
        renderer.reset()
        renderer.profiler.enabled = by_query
        budget_ms = None if by_query else SLICE_MS
        samples, spent = 0, 0.0
        while True:
            while not renderer.ready(
                candidate.view, subject.camera, settings, time_s=subject.time_s, time_budget_ms=budget_ms
            ):
                yield None
            begin = self.clock()
            renderer.draw(candidate.view, subject.camera, settings, time_s=subject.time_s, time_budget_ms=budget_ms)
            self.ctx.finish()
            spent += self.clock() - begin
            whole = renderer.converged_samples > samples
            yield 1e3 * spent if whole else None
            if whole:
                samples, spent = renderer.converged_samples, 0.0
