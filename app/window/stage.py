"""The scene and the renderers behind the window's picture: what is drawn, when it rests, what lies under a pixel."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np

from ..camera import Camera, Viewpoint
from ..errors import UserError
from ..files import user_path
from ..frame.targets import TARGETS
from ..gpu.rehearsal import Rehearsal
from ..gpu.scene import GpuScene
from ..optics import SKY_DEPTH
from ..panel.model import Cost, Look
from ..panel.scenes import camera_files
from ..renderer import Renderer
from ..scene import gallery
from ..scene.facts import Facts, frame_facts
from ..scene.model import Scene
from ..session import load_gpu_scene, viewpoints
from ..settings import Settings
from .side import LEAST, Choice, Side

Size = tuple[int, int]
Progress = Callable[[str, float], None]

BUDGET_MS = 60.0  # of a time-sliced view per frame: the window answers some ten times a second
FIT_PERCENTILES = (1.0, 99.0)  # of a fitted range: outliers such as specks do not flatten the rest


@dataclass
class Stage:
    """One scene, seen by one renderer or, in the split screen, two. Owns them all, and the programs they share.

    `compiles`: how many programs may be compiled in a turn, while the nearest picture that is ready is shown, and a
    tree for rays is built beside it; None: `draw` waits for whatever it needs.
    """

    ctx: moderngl.Context
    progress: Progress
    compiles: int | None = None
    name: str = ""
    scene: Scene | None = None
    viewpoints: tuple[Viewpoint, ...] = ()
    sides: list[Side] = field(default_factory=list)
    edition: int = 0  # grows with each scene and with each reading of the shaders
    rehearsal: Rehearsal = field(init=False)
    idle: bool = False  # of the last `draw`: there was nothing it could do yet
    _gpu_scene: GpuScene | None = None
    _builds: int = 0  # when the turn began
    _compiling: float | None = None  # the part that is ready of what is waited for

    def __post_init__(self) -> None:
        self.rehearsal = Rehearsal(self.ctx, self.compiles)

    def load(self, name: str) -> None:
        """Replace the scene. Raises UserError, in which case the old one stays."""
        scene, gpu_scene = load_gpu_scene(self.ctx, name, self.progress)
        old, self._gpu_scene = self._gpu_scene, gpu_scene
        self.scene, self.name = scene, name
        self.edition += 1
        for side in self.sides:
            side.renderer.scene = gpu_scene
            side.renderer.reset()
            side.renderer.profiler.forget()
            side.forget()
        self._compiling = None
        if old:
            old.release()
        built_in = gallery.find(name)
        beside = () if built_in else camera_files(user_path(name))
        own = viewpoints(scene, (np.array(gpu_scene.facts.low), np.array(gpu_scene.facts.high)))
        self.viewpoints = (*own, *beside)  # what lies beside it is on offer; the first is that of every command

    def renderer(self, size: Size) -> Renderer:
        """Another renderer of the scene, which belongs to the caller and draws whatever scene was last given to it."""
        assert self._gpu_scene is not None, "load a scene first"
        made = Renderer(
            self.ctx,
            self._gpu_scene,
            size,
            timing_source=self.timing_source or None,
            share_memory=True,
            rehearsal=self.rehearsal,
        )
        made.progress_callback = self.progress
        return made

    @property
    def gpu_scene(self) -> GpuScene | None:
        return self._gpu_scene

    @property
    def moves(self) -> bool:
        """Whether anything in the scene ever does."""
        return self._gpu_scene is not None and self._gpu_scene.facts.objects

    @property
    def extent(self) -> float:
        """Diagonal of the scene [m]."""
        assert self._gpu_scene is not None, "load a scene first"
        return float(np.linalg.norm(np.subtract(self._gpu_scene.facts.high, self._gpu_scene.facts.low)))

    def facts(self, settings: Settings, camera: Camera) -> Facts:
        """What a still frame from there meets, as large as the last one."""
        assert self._gpu_scene is not None, "load a scene first"
        size = self.sides[0].renderer.size if self.sides else (1, 1)
        return frame_facts(self._gpu_scene.facts, camera, settings.lens, size, self._gpu_scene.near_plane)

    def pending(self, look: Look, camera: Camera, size: Size, time_s: float = 0.0) -> tuple[bool, bool]:
        """(something changed since the last drawing, something still converges)."""
        views = _views(look)
        changed = len(self.sides) != len(views) or any(
            side.drawn != _key(view, look, camera, size, time_s) for side, view in zip(self.sides, views, strict=False)
        )
        return changed, any(side.samples < side.limit for side in self.sides)

    @property
    def preparing(self) -> tuple[str, float] | None:
        """What the picture that was asked for still waits for, and which part of that is done; None: it is drawn."""
        tree = self._gpu_scene.tree_progress if self._gpu_scene else None
        return None if self._compiling is None else tree or ("compiling shaders", self._compiling)

    @property
    def traces(self) -> bool:
        """Whether the scene has a tree for rays."""
        return self._gpu_scene is not None and self._gpu_scene.has_tree

    @property
    def building(self) -> bool:
        """Whether a thread makes the scene's tree."""
        return self._gpu_scene is not None and self._gpu_scene.tree_progress is not None

    def begin_turn(self) -> None:
        """Grant what a turn may make ready, and take the tree that a thread has finished, whoever asked for it."""
        self.rehearsal.begin_turn()
        self._builds = self.rehearsal.programs.builds
        if self._gpu_scene and self.building:
            with suppress(UserError):  # told when somebody asks for it again
                self._gpu_scene.request_tree()

    @property
    def compiled(self) -> int:
        """Programs since the turn began."""
        return self.rehearsal.programs.builds - self._builds

    @property
    def held_up(self) -> bool:
        """Whether nothing more can be made ready in this turn."""
        return self.building or (self.rehearsal.patient and self.rehearsal.spent)

    def draw(self, look: Look, camera: Camera, size: Size, time_s: float = 0.0) -> None:
        """Draw the next frame of each side that is not at rest. Raises UserError for a target that nothing writes."""
        views = _views(look)
        self._provide(len(views), size)
        self._compiling, self.idle = None, True
        for side, view in zip(self.sides, views, strict=True):
            side.resize(size)
            shown = self._choice(side, Choice(view, look.settings), camera, time_s)
            if shown is None:
                continue
            key = (shown.view, shown.settings, camera, size, time_s)
            if side.drawn == key and side.samples >= side.limit:
                continue
            self.idle = False
            side.renderer.profiler.enabled = look.panel
            side.renderer.health.watched = "in turn" if look.panel else "nothing"
            side.texture = side.renderer.draw(
                shown.view, camera, shown.settings, time_s=time_s, cut=shown.cut, time_budget_ms=self._budget_ms
            )
            side.still = side.still + 1 if side.drawn == key else 1
            side.drawn, side.view, side.settings = key, shown.view, shown.settings
        self.idle = self.idle and not (self.rehearsal.patient and self.rehearsal.spent)

    def _choice(self, side: Side, wanted: Choice, camera: Camera, time_s: float) -> Choice | None:
        """What a side draws now: what is wanted, or what is ready and nearest to it, or nothing. Where nothing has been
        drawn, the programs of what takes least come first.
        """
        key = (wanted.view, wanted.settings, camera, side.renderer.size, time_s)
        options: dict[str, Any] = {"time_s": time_s, "time_budget_ms": self._budget_ms}
        if side.drawn == key and side.samples >= side.limit:
            return wanted
        if not side.view:
            side.renderer.ready(LEAST, camera, wanted.settings, **options)
        if side.renderer.ready(wanted.view, camera, wanted.settings, **options):
            return wanted
        self._compiling = self.rehearsal.part
        return side.stand_in(wanted.settings, camera, **options)

    @property
    def _budget_ms(self) -> float:
        return BUDGET_MS / len(self.sides)

    def depth_at(self, across: float, down: float, look: Look) -> float | None:
        """Planar depth [m] at a fraction of the picture's width and height from the top left; None in the sky."""
        if not self.sides:  # a click while the first scene loads
            return None
        side = self.sides[-1 if look.compare and across > look.bar else 0]
        width, height = side.renderer.size
        depth = side.renderer.depth_at(int(across * width), int(down * height))
        return depth if 0.0 < depth < 0.5 * SKY_DEPTH else None  # 0: this view drew no geometry

    def picture(self, look: Look) -> np.ndarray:
        """What the picture shows (h, w, 3) uint8 sRGB, top row first, split at the bar.

        Raises UserError before the first frame.
        """
        if not self.sides:
            raise UserError("there is no picture to save yet")
        left = self.sides[0].renderer.picture()
        if look.compare and len(self.sides) > 1:  # the second side exists from its first frame on
            column = round(look.bar * left.shape[1])
            left[:, column:] = self.sides[1].renderer.picture()[:, column:]
        return left

    def fitted_range(self, look: Look) -> tuple[float, float] | None:
        """Ends of the colour map that hold nearly all values of the first side that shows a target, if any."""
        for side in self.sides:
            if side.view in TARGETS and TARGETS[side.view].show in ("signed", "scalar", "vector"):
                return value_range(side.renderer.read(side.view), TARGETS[side.view].show)
        return None

    def reload_shaders(self) -> str:
        """Re-read the shader files; an error's text, in which case the last good programs go on, or nothing."""
        error = self.rehearsal.programs.reload()
        self.edition += 1
        for side in self.sides:
            side.renderer.reset()
            side.drawn = None
        return error or ""

    def costs(self) -> tuple[Cost, ...]:
        return tuple(side.cost() for side in self.sides if side.view)

    @property
    def memory(self) -> dict[str, int]:
        """GPU bytes by resource over both sides; the scene counts once."""
        total: dict[str, int] = {}
        for index, side in enumerate(self.sides):
            for name, size in side.renderer.memory.items():
                if index == 0 or not name.startswith("scene: "):
                    total[name] = total.get(name, 0) + size
        return total

    @property
    def timing_source(self) -> str:
        return self.sides[0].renderer.profiler.source if self.sides else ""

    def release(self) -> None:
        """Free everything on the GPU."""
        for side in self.sides:
            side.renderer.release()
        self.sides.clear()
        if self._gpu_scene:
            self._gpu_scene.release()
            self._gpu_scene = None
        self.rehearsal.release()

    def _provide(self, count: int, size: Size) -> None:
        while len(self.sides) > count:
            self.sides.pop().renderer.release()
        while len(self.sides) < count:
            self.sides.append(Side(self.renderer(size)))


def value_range(values: np.ndarray, show: str) -> tuple[float, float]:
    """A colour map's ends for texels (h, w, c): symmetric about 0 for signed values, 0 to the longest for vectors."""
    if show == "vector":
        values = np.linalg.norm(values[..., :2], axis=-1)
    elif show == "scalar":
        values = values[..., 0]
    finite = values[np.isfinite(values) & (np.abs(values) < 0.5 * SKY_DEPTH)]
    if not finite.size:
        return 0.0, 1.0
    low, high = (float(x) for x in np.percentile(finite, FIT_PERCENTILES))
    if show == "signed":
        high = max(abs(low), abs(high))
        low = -high
    if show == "vector":
        low = 0.0
    return low, high if high > low else low + 1.0


def _views(look: Look) -> tuple[str, ...]:
    return (look.view, look.other) if look.compare else (look.view,)


def _key(view: str, look: Look, camera: Camera, size: Size, time_s: float) -> tuple[Any, ...]:
    return view, look.settings, camera, size, time_s
