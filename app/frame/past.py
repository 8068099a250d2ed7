"""What the frames drawn so far leave to the next one: when they were, how many, and whether they count for it."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..camera import Moment
from .progress import Progress


@dataclass
class Past:
    """The frames that were put together since the last start."""

    frames: int = 0  # whole ones
    drawn: Moment | None = None  # the last one's, unless its history was dropped
    progress: Progress = field(default_factory=Progress)  # of a running mean
    _key: object = None

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
