"""One side of the window: a renderer, what it last drew, and what it draws instead of what is not ready."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import moderngl

from ..camera import Camera
from ..errors import UserError
from ..frame.pipeline import CONVERGING
from ..panel.model import Cost
from ..renderer import Renderer
from ..settings import Settings

REST_STILL = 256  # frames of a still picture until it rests: the jitter's mean has long converged below 8 bits
REST_TRACED = 1 << 16  # lens samples per pixel until a running mean rests: noise 1/256 of one sample's
LEAST = "sharp"  # the view with the fewest programs
STAND_INS = ("post", LEAST)  # for a view whose programs or tree are not ready, after what was drawn last


class Choice(NamedTuple):
    """What a side may draw."""

    view: str
    settings: Settings
    cut: bool = False  # afresh: without history, and so without motion


@dataclass
class Side:
    """One renderer, what it last drew, and for how many frames that has stood still."""

    renderer: Renderer
    drawn: Any = None
    still: int = 0
    view: str = ""
    settings: Settings | None = None
    texture: moderngl.Texture | None = None

    @property
    def samples(self) -> int:
        return self.renderer.converged_samples if self.view in CONVERGING else self.still

    @property
    def limit(self) -> int:
        """Samples after which nothing changes any more."""
        if self.view in CONVERGING:
            return REST_TRACED
        plan = self.renderer.plan
        return REST_STILL if plan and any(call.step.history or call.step.updates for call in plan.calls) else 1

    def cost(self) -> Cost:
        return Cost(
            self.view,
            self.renderer.plan,
            tuple(self.renderer.timings),
            self.samples,
            self.limit,
            self.renderer.size,
            dict(self.renderer.health.found),
            dict(self.renderer.profiler.before_ms),
        )

    def forget(self) -> None:
        """Of another scene, nothing that was drawn says anything; its last picture stays until the first of the new."""
        self.drawn, self.view, self.settings = None, "", None

    def resize(self, size: tuple[int, int]) -> None:
        if size != self.renderer.size:
            self.renderer.resize(size)
            self.texture = None  # it is gone

    def stand_in(self, settings: Settings, camera: Camera, **options: Any) -> Choice | None:
        """The nearest to a picture under `settings` that can be drawn at once, or None: what was drawn last, if need be
        afresh, which takes no programs for motion. `options` as of Renderer.ready.
        """
        last = [Choice(self.view, self.settings, cut) for cut in (False, True)] if self.settings else []
        others = [Choice(name, settings) for name in STAND_INS]
        for choice in (*last, *others):
            with suppress(UserError):  # what the scene has no use for
                if self.renderer.ready(choice.view, camera, choice.settings, cut=choice.cut, **options):
                    return choice
        return None
