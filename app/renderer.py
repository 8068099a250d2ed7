"""The renderer: the one owner of GPU objects, and the one loop that runs a plan. Bind by name, time, dispatch."""

from __future__ import annotations

import time
from collections.abc import Callable

import moderngl
import numpy as np

from .camera import Camera, Moment
from .frame.lifetimes import PICKED, Slot
from .frame.memory import frame_blocks, frame_slots
from .frame.past import Past
from .frame.pipeline import CONVERGING, LENS_POINTS, LENS_RAYS, VIEWS, frame_plan, linear_target
from .frame.records import Call, FramePlan
from .frame.targets import TARGETS
from .gpu.execute import run_call
from .gpu.frame_block import FrameInputs, frame_block
from .gpu.health import Health
from .gpu.layout import FRAME
from .gpu.rehearsal import Rehearsal
from .gpu.scene import GpuScene
from .gpu.targets import Targets
from .gpu.timing import Profiler
from .scene.facts import Facts, frame_facts, is_cut, with_every_effect
from .settings import Settings, history_key


class Renderer:
    """Draws views of one scene at one size. Two renderers may share a GpuScene and programs (split screen): those of a
    `rehearsal`, which then says whether pictures wait for programs, and stays its owner's.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        scene: GpuScene,
        size: tuple[int, int],
        *,
        seed: int = 0,
        timing_source: str | None = None,
        share_memory: bool = False,
        rehearsal: Rehearsal | None = None,
    ) -> None:
        """With `share_memory` targets that a frame needs one after the other are one texture: `read` then knows what
        the plan leaves (`pipeline.read_after`, histories and running means), and raises for what it overwrote.
        """
        self._ctx, self.scene, self.seed = ctx, scene, seed
        self._targets = Targets(ctx, size)
        self._rehearsal, self._lent = rehearsal or Rehearsal(ctx), rehearsal is not None
        self._frame_buffer = ctx.buffer(reserve=FRAME.itemsize)
        self.profiler = Profiler(ctx, timing_source)
        self.health = Health(ctx, self._rehearsal)
        self.plan: FramePlan | None = None
        self._plan_key: object = None
        self._found_ready: object = None  # plan, scene and programs that were
        self._share = share_memory
        self._slots: tuple[Slot, ...] = ()
        self._past = Past()
        self.progress_callback: Callable[[str, float], None] | None = None
        self.cpu_ms = 0.0  # of this thread in the last `draw`, waits excluded
        self.every_effect = False  # plan as if the scene called for all of them: a measure of what plans save
        self.moved = False  # whether camera or objects did in the last frame, since the one before it

    # -- what users call -----------------------------------------------------------------------------------------------

    def draw(
        self,
        view: str,
        camera: Camera,
        settings: Settings,
        *,
        time_s: float = 0.0,
        cut: bool = False,
        time_budget_ms: float | None = None,
    ) -> moderngl.Texture:
        """Draw one frame of `view` (a view or a target's name) and return the `display` texture, bottom row first.

        `time_s` is when moving objects are shown. A still picture and unchanged settings accumulate; a cut, told or
        recognised (app/scene/facts.py), starts afresh. With a time budget the traced view does as many rows as fit.
        """
        begin_cpu = time.thread_time()
        now, goes_on = self._next(view, camera, settings, time_s, cut)
        if not goes_on:
            self._past.restart(self._history_of(view, settings))
            self._targets.forget((*CONVERGING, PICKED))
        previous = self._past.previous(now)
        self.moved = now != previous
        plan = self._planned(view, settings, self._facts(view, now, goes_on, settings, time_budget_ms))
        rows = self._past.rows(plan, self.size[1], settings.rays.samples_per_frame, time_budget_ms)
        inputs = self._inputs(view, now, previous, settings, rows, self._past.frames)
        self.scene.place(now.time_s, previous.time_s)
        if any(call.shadowed for call in plan.calls):
            self.scene.update_shadow(self._rehearsal.programs)
        self._frame_buffer.write(frame_block(inputs).tobytes())
        self.health.begin_frame(plan)
        self._targets.begin(self._slots, frame_blocks(plan))
        for call in self._past.calls(plan):
            slice_begin = self._clock() if call.step.sliced and time_budget_ms is not None else 0.0
            with self.profiler.scope(call.step.name):
                self._run(call, inputs)
            self._ctx.memory_barrier()
            self.health.after(call, self._targets)
            if slice_begin:
                done = (rows[1] - rows[0]) * settings.rays.samples_per_frame
                self._past.progress.learn(done, self._clock() - slice_begin)
        self._end_frame(view, plan, inputs)
        self.cpu_ms = (time.thread_time() - begin_cpu) * 1e3
        return self._targets.texture("display")

    def ready(
        self,
        view: str,
        camera: Camera,
        settings: Settings,
        *,
        time_s: float = 0.0,
        cut: bool = False,
        time_budget_ms: float | None = None,
    ) -> bool:
        """Whether `draw` would neither compile nor wait for the scene's tree. Brings that nearer: asks for the tree,
        compiles as much as the rehearsal allows in this turn. Raises UserError as `draw` does.
        """
        if not self._rehearsal.patient:
            return True
        now, goes_on = self._next(view, camera, settings, time_s, cut)
        facts = self._facts(view, now, goes_on, settings, time_budget_ms)
        plan = frame_plan(view, settings, facts)
        found = plan, self.scene, self.scene.has_tree, self._rehearsal.programs.losses
        if found != self._found_ready:
            has_tree = not any(call.step.rays for call in plan.calls) or self.scene.request_tree()
            if not (self.rehearse(plan.parts, view, camera, settings) and has_tree):
                return False
            self._found_ready = found
        return True

    def rehearse(self, calls: tuple[Call, ...], view: str, camera: Camera, settings: Settings) -> bool:
        """Whether calls of such a view can run without compiling, after as much of it as this turn may do."""
        now = Moment(camera, 0.0)
        return self._rehearsal.ready(calls, self.scene, self._inputs(view, now, now, settings, (0, self.size[1]), 0))

    @property
    def size(self) -> tuple[int, int]:
        return self._targets.size

    def resize(self, size: tuple[int, int]) -> None:
        """Change the picture's size; everything accumulated is dropped."""
        if size != self._targets.size:
            self._targets.resize(size)
            self.profiler.forget()
            self._plan_key = None  # what fitted at another size may not at this one
            self.reset()

    def reset(self) -> None:
        """Drop accumulated samples: the next frame starts afresh."""
        self._past.forget()

    def read(self, target: str) -> np.ndarray:
        """Texels (h, w, c) of a target, bottom row first, as float32 (uint8 for `display`). Waits for the GPU."""
        previous = TARGETS[target].history  # after a frame the value it wrote is where the next frame looks for history
        values = self._targets.read(target, previous)
        return values if values.dtype == np.uint8 else values.astype(np.float32)

    def picture(self) -> np.ndarray:
        """The last frame as (h, w, 3) uint8 sRGB, top row first."""
        return np.ascontiguousarray(self._targets.read("display")[::-1, :, :3])

    def linear(self) -> np.ndarray:
        """The last frame's linear radiance (h, w, 3) float32, top row first, before exposure and tone mapping.

        Not below 0, as the first frames of the hybrid view may be on their way to the mean.
        """
        assert self.plan is not None, "draw a frame first"
        return np.maximum(self.read(linear_target(self.plan))[::-1, :, :3], 0.0)

    def linear_texture(self) -> moderngl.Texture:
        """The same on the GPU, bottom row first, for reading before the next frame is drawn."""
        assert self.plan is not None, "draw a frame first"
        target = linear_target(self.plan)
        return self._targets.texture(target, previous=TARGETS[target].history)

    def depth_at(self, x: int, y: int) -> float:
        """Planar depth [m] under a pixel counted from the top left; SKY_DEPTH where nothing is. Needs a frame that drew
        a G-buffer: 0 where none did.
        """
        if not self._targets.holds(PICKED):
            return 0.0
        width, height = self.size
        row = height - 1 - min(max(y, 0), height - 1)
        return float(self._targets.read(PICKED)[row, min(max(x, 0), width - 1), 0])

    @property
    def converged_samples(self) -> int:
        """Frames (or lens samples per pixel, for a running mean) accumulated so far."""
        return self._past.samples

    @property
    def timings(self) -> list[tuple[str, float]]:
        """(pass, median ms) of the current plan's passes, in frame order."""
        times = self.profiler.median_ms()
        return [(c.step.name, times[c.step.name]) for c in self.plan.calls if c.step.name in times] if self.plan else []

    @property
    def memory(self) -> dict[str, int]:
        """GPU bytes by target, block and scene resource."""
        return {**self._targets.bytes, **{f"scene: {name}": count for name, count in self.scene.bytes.items()}}

    def reload_shaders(self) -> str | None:
        """Re-read the shader files; returns an error's text, in which case the last good programs go on."""
        error = self._rehearsal.programs.reload()
        self.reset()
        return error

    def release(self) -> None:
        self._targets.release()
        self.health.release()
        if not self._lent:
            self._rehearsal.release()
        self.profiler.release()
        self._frame_buffer.release()

    # -- one frame -----------------------------------------------------------------------------------------------------

    def _next(self, view: str, camera: Camera, settings: Settings, time_s: float, cut: bool) -> tuple[Moment, bool]:
        """The moment that a frame would show, and whether what was accumulated counts for it."""
        now = Moment(camera, float(time_s) if self.scene.facts.objects else 0.0)
        before = self._past.drawn and self._past.drawn.camera
        cut = cut or bool(before and is_cut(before, camera, self.scene.facts, self.scene.near_plane, self.size))
        return now, not cut and self._past.goes_on(self._history_of(view, settings), now, view in CONVERGING)

    def _history_of(self, view: str, settings: Settings) -> object:
        """Equal for frames whose samples may be put together."""
        return view, history_key(settings), self.size, id(self.scene)

    def _facts(self, view: str, now: Moment, goes_on: bool, settings: Settings, budget_ms: float | None) -> Facts:
        previous = self._past.previous(now, goes_on)
        facts = frame_facts(
            self.scene.facts,
            now.camera,
            settings.lens,
            self.size,
            self.scene.near_plane,
            camera_moved=now.camera != previous.camera,
            objects_moved=now.time_s != previous.time_s,
            unsampled=view in LENS_RAYS and budget_ms is not None and not (goes_on and self._past.progress.samples),
        )
        return with_every_effect(facts) if self.every_effect else facts

    def _planned(self, view: str, settings: Settings, facts: Facts) -> FramePlan:
        key = (view, settings, facts)
        if key != self._plan_key:
            plan = frame_plan(view, settings, facts)
            slots = frame_slots(plan, self._share)
            self._targets.reserve(slots, frame_blocks(plan))
            if self.plan is None or [c.step.name for c in plan.calls] != [c.step.name for c in self.plan.calls]:
                self.profiler.reset()
            self.plan, self._plan_key, self._slots = plan, key, slots
        assert self.plan is not None
        return self.plan

    def _inputs(
        self, view: str, now: Moment, previous: Moment, settings: Settings, rows: tuple[int, int], frame_index: int
    ) -> FrameInputs:
        return FrameInputs(
            now=now,
            previous=previous,
            settings=settings,
            size=self.size,
            frame_index=frame_index,
            seed=self.seed,
            near_plane=self.scene.near_plane,
            scene=self.scene,
            through_lens=view in LENS_POINTS,
            rows=rows,
            show=TARGETS[view] if view in TARGETS and view not in VIEWS else None,
        )

    def _run(self, call: Call, inputs: FrameInputs) -> None:
        if call.step.rays:
            self.scene.ensure_bvh(self.progress_callback)
        programs, block = self._rehearsal.programs, self._frame_buffer
        run_call(self._ctx, call, programs, self._targets, self.scene, block, inputs.rows)

    def _clock(self) -> float:
        """Seconds, once the GPU has done all it was given."""
        self._ctx.finish()
        return time.perf_counter()

    def _end_frame(self, view: str, plan: FramePlan, inputs: FrameInputs) -> None:
        for target in dict.fromkeys(t for call in plan.calls for t in call.writes if TARGETS[t].history):
            self._targets.swap(target)
        self.profiler.end_frame()
        mean = inputs.settings.rays.samples_per_frame if view in LENS_RAYS else int(view in CONVERGING)
        self._past.add(inputs.now, inputs.rows[1] if inputs.rows[1] < self.size[1] else 0, mean)
