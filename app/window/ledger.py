"""What passes that are left out would cost: measured when asked for, one frame of it between two of the window."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import Any

from ..camera import Moment
from ..errors import UserError
from ..measure.savings import Costs, measuring
from ..renderer import Renderer
from .stage import Stage
from .state import State


class Ledger:
    """One measuring at a time, with a renderer of its own; its figures hold while scene and size stay."""

    def __init__(self, state: State, stage: Stage) -> None:
        self._state, self._stage = state, stage
        self._renderer: Renderer | None = None
        self._steps: Generator[float, None, Costs] | None = None
        self._key: Any = None
        self._full_ms: dict[str, float] = {}
        self.part: float | None = None  # that is done

    @property
    def full_ms(self) -> Mapping[str, float]:
        """Of each pass with every effect on, as far as it was measured for this scene at this size."""
        return self._full_ms if self._key == self._now() else {}

    def start(self) -> None:
        """Measure the view on screen. Raises UserError if there is none."""
        self.stop()
        if not self._stage.sides:
            raise UserError("there is no picture yet to measure")
        look, moment = self._state.look, Moment(self._state.camera, self._state.time_s)
        self._renderer, self._key = self._stage.renderer(self._stage.sides[0].renderer.size), self._now()
        self._steps = measuring(self._stage.ctx, self._renderer, look.view, moment, look.settings, rounds=1)
        self.part = 0.0

    def advance(self) -> bool:
        """Draw one frame of it; False where there is nothing to do."""
        if self._steps is None:
            return False
        try:
            self.part = next(self._steps)
        except StopIteration as end:
            self._full_ms = {cost.name: cost.full_ms for cost in end.value.passes if cost.full_ms is not None}
            self.stop()
        except UserError as error:
            self.stop()
            self._state.say(str(error))
        return True

    def stop(self) -> None:
        """End it, and free what it holds."""
        if self._steps:
            self._steps.close()
        if self._renderer:
            self._renderer.release()
        self._steps = self._renderer = self.part = None

    def _now(self) -> Any:
        sides = self._stage.sides
        return self._stage.edition, sides[0].renderer.size if sides else None
