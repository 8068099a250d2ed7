"""Where the picture on screen is wrong: its true picture, drawn on demand frame by frame, and the map of the error."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import moderngl

from ..camera import Camera
from ..frame.pipeline import VIEWS
from ..measure.live import HEAT_RANGE, LiveError
from ..measure.reference import Reference, drawing
from ..measure.subject import Key, plainly, truth_values
from ..panel.model import HeatShown
from ..renderer import Renderer
from ..settings import Settings
from .stage import Side, Stage

POINTS = 64  # lens points of the true picture: it is as large as the one on screen, and each may take a while


class Heat:
    """Draws the reference with a renderer that exists only meanwhile; measures what the stage's first side shows."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._live = stage, LiveError(stage.ctx, stage.rehearsal.programs)
        self._key: Key | None = None
        self._drawing: Generator[float, None, Reference] | None = None
        self._renderer: Renderer | None = None
        self._reference: Reference | None = None
        self._part = 0.0
        self._painted: tuple[object, ...] = ()
        self._map: moderngl.Texture | None = None

    def aim(self, camera: Camera, settings: Settings, size: tuple[int, int], time_s: float) -> None:
        """Show the error of this picture from now on."""
        key = self._key_of(settings, camera, size, time_s)
        if key != self._key:
            self._stop()
            self._key, self._reference, self._map, self._part = key, None, None, 0.0
            self._painted = ()
            self._live.forget()
            self._renderer = self._stage.renderer(size)
            self._drawing = drawing(self._renderer, camera, plainly(settings), POINTS, time_s=time_s)

    @property
    def busy(self) -> bool:
        return self._drawing is not None

    def step(self) -> None:
        """Draw one frame of the reference."""
        assert self._drawing is not None
        try:
            self._part = next(self._drawing)
            self._stage.ctx.finish()
        except StopIteration as end:
            self._reference = end.value
            self._live.set_reference(end.value)
            self._stop()

    def texture(self, side: Side, settings: Settings) -> moderngl.Texture | None:
        """The map over this side's picture, which is measured, too; None while there is none. Nothing is done again
        before something has changed.
        """
        if self._reference is None or not self._fits(side):
            return None
        painted = (self._key, side.drawn, side.still, side.samples, settings.overlay)
        if painted != self._painted:
            self._painted = painted
            self._live.update(side.renderer)
            if side.samples >= side.limit:
                self._live.finish()
            self._map = self._live.heat_map(side.renderer, settings.overlay)
        return self._map

    def shown(self, side: Side | None, settings: Settings) -> HeatShown:
        """What the panel tells of it and of this side's picture."""
        low, high = settings.overlay.range_low, settings.overlay.range_high
        ends = (low, high) if low != high else HEAT_RANGE
        ready = self._reference is not None and side is not None and side.view in VIEWS and self._fits(side)
        return HeatShown(
            ready, self._part if self.busy else 0.0, ends, self._live.latest if ready else None, self._live.floor
        )

    def release(self) -> None:
        self._stop()
        self._live.release()

    def _fits(self, side: Side) -> bool:
        if side.drawn is None:
            return False
        _, settings, camera, size, time_s = side.drawn
        return self._key_of(settings, camera, size, time_s) == self._key

    def _key_of(self, settings: Settings, camera: Camera, size: tuple[int, int], time_s: float) -> Key:
        return self._stage.edition, truth_values(settings), camera, size, time_s

    def _stop(self) -> None:
        drawing_now: Any = self._drawing
        if drawing_now:
            drawing_now.close()
        if self._renderer:
            self._renderer.release()
        self._drawing = self._renderer = None
