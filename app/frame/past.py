"""What the frames drawn so far leave to the next one: when they were, how many, and whether they count for it."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..camera import Moment
from .progress import Progress
from .records import Call, FramePlan


@dataclass
class Past:
    """The frames that were put together since the last start."""

    frames: int = 0  # whole ones
    drawn: Moment | None = None  # the last one's, unless its history was dropped
    progress: Progress = field(default_factory=Progress)  # of a running mean
    _key: object = None
    _plan: FramePlan | None = None  # the last frame's

    def forget(self) -> None:
        """Nothing counts any more."""
        self._key = None

    def goes_on(self, key: object, now: Moment, mean: bool) -> bool:
        """Whether it counts for a frame at `now`: one whose samples may be put together with the last ones, as equal
        keys say, and, if it adds to a running mean, one of the same picture.
        """
        return key == self._key and not (mean and now != self.drawn)

    def restart(self, key: object) -> None:
        """The next frame is the first of its kind."""
        self._key, self.frames, self.drawn = key, 0, None
        self.progress.restart()

    def previous(self, now: Moment, goes_on: bool = True) -> Moment:
        """The frame before one at `now`, or that one itself where the past does not count."""
        return (goes_on and self.drawn) or now

    def rows(self, plan: FramePlan, height: int, samples: int, budget_ms: float | None) -> tuple[int, int]:
        """The slice of a picture that the next frame draws, at so many samples a pixel: first row and one past the
        last.
        """
        if budget_ms is not None and any(call.step.sliced for call in plan.calls):
            return self.progress.next_rows(height, samples, budget_ms)
        return 0, height

    def calls(self, plan: FramePlan) -> tuple[Call, ...]:
        """What it runs. A continued slice starts at the sliced pass: nothing before it has changed since."""
        calls, continued = plan.calls, self.progress.row > 0 and plan is self._plan
        self._plan = plan
        return calls[next(i for i, call in enumerate(calls) if call.step.sliced) :] if continued else calls

    def add(self, now: Moment, next_row: int, samples: int) -> None:
        """A frame was drawn, or a slice of one: then `next_row`, else 0, is where to go on. A whole one brought so many
        `samples` per pixel of a running mean.
        """
        self.drawn, self.progress.row = now, next_row
        if not next_row:
            self.frames += 1
            self.progress.samples += samples

    @property
    def samples(self) -> int:
        """Lens samples per pixel of a running mean; frames of anything else."""
        return self.progress.samples or self.frames
