"""The error of what is on screen, while it is drawn: against a reference of the same camera and settings, on the GPU.

The same figures as app/measure/metrics.py, except for FLIP, which takes longer than a frame may.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..gpu.context import Context
from ..gpu.error_sums import ErrorSums
from ..gpu.programs import Programs
from ..renderer import Renderer
from ..settings import Overlay
from .metrics import WHOLE, Errors, errors_of_means
from .reference import Reference
from .regions import REGIONS

HEAT_RANGE = (0.0, 0.1)  # of the displayed difference, 0..1: 25 levels of 255 are seen at once


class LiveError:
    """Compares a renderer's frames with one reference. It is up to the caller that both show the same."""

    def __init__(self, ctx: Context, programs: Programs) -> None:
        self._sums = ErrorSums(ctx, programs, len(REGIONS))
        self._latest: dict[str, Errors] | None = None
        self.floor: dict[str, Errors] | None = None  # of the reference (reference.py), without FLIP

    def set_reference(self, reference: Reference) -> None:
        """Compare with this from now on."""
        self._sums.set_truth(reference.picture, reference.labels)
        self._latest = None
        self.floor = errors_of_sums(self._sums.sums_of(reference.halves[0]))

    def forget(self) -> None:
        """Compare with nothing until another reference is set."""
        self._latest = self.floor = None
        self._sums.forget()

    def update(self, renderer: Renderer) -> None:
        """Measure the renderer's last frame. `latest` follows a few frames later, so that nothing waits.

        A frame that has another size than the reference, or shows a target instead of a view, has no error.
        """
        if not self._fits(renderer):
            self._latest = None
            return
        self._sums.queue(renderer.linear_texture())
        if (sums := self._sums.sums()) is not None:
            self._latest = errors_of_sums(sums)

    def finish(self) -> dict[str, Errors] | None:
        """The errors of the frame updated last. Waits for the GPU."""
        if (sums := self._sums.sums(age=0)) is not None:
            self._latest = errors_of_sums(sums)
        return self._latest

    @property
    def latest(self) -> dict[str, Errors] | None:
        """Over the whole picture, first, and each of REGIONS (NaN where empty); FLIP is NaN. None: not yet known."""
        return self._latest

    def heat_map(self, renderer: Renderer, overlay: Overlay | None = None) -> Any:
        """A texture of display values, like the renderer's own, that shows where its last frame is wrong; None where
        `update` measures nothing.

        The colour map runs over the overlay's range, or HEAT_RANGE if that is empty.
        """
        if not self._fits(renderer):
            return None
        low, high = (overlay.range_low, overlay.range_high) if overlay else (0.0, 0.0)
        return self._sums.paint(renderer.linear_texture(), *((low, high) if low != high else HEAT_RANGE))

    def release(self) -> None:
        self._sums.release()

    def _fits(self, renderer: Renderer) -> bool:
        drawn = renderer.plan is not None and renderer.plan.calls[-1].step.name == "display"
        return drawn and renderer.size == self._sums.size


def errors_of_sums(sums: NDArray[np.float64]) -> dict[str, Errors]:
    """The figures that follow from (regions, 4) sums of the three squared errors and of the pixels."""
    with np.errstate(invalid="ignore"):  # an empty region is 0 / 0, NaN
        means = np.vstack([sums.sum(0), sums])
        means = means[:, :3] / means[:, 3:]
    return {name: errors_of_means(*map(float, mean)) for name, mean in zip((WHOLE, *REGIONS), means, strict=True)}
