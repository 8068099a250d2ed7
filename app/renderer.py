"""The renderer: the one owner of GPU objects, and the one loop that runs a plan. Bind by name, time, dispatch."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import moderngl
import numpy as np

from .camera import Camera, Moment
from .frame.pipeline import CONVERGING, LENS_POINTS, LENS_RAYS, VIEWS, frame_plan, linear_target
from .frame.progress import Progress
from .frame.records import Call, Defines, FramePlan
from .frame.targets import TARGETS
from .gpu.bind import bind
from .gpu.frame_block import FrameInputs, frame_block
from .gpu.health import Health
from .gpu.layout import FRAME
from .gpu.programs import Programs, check_names
from .gpu.scene import GpuScene
from .gpu.targets import Targets
from .gpu.timing import Profiler
from .scene.facts import Facts, frame_facts, is_cut
from .settings import Settings, history_key


class Renderer:
    """Draws views of one scene at one size. Two renderers may share a GpuScene (split screen)."""

    def __init__(
        self,
        ctx: moderngl.Context,
        scene: GpuScene,
        size: tuple[int, int],
        *,
        seed: int = 0,
        timing_source: str | None = None,
    ) -> None:
        self._ctx, self.scene, self.seed = ctx, scene, seed
        self._targets = Targets(ctx, size)
        self._programs = Programs(ctx)
        self._frame_buffer = ctx.buffer(reserve=FRAME.itemsize)
        self.profiler = Profiler(ctx, timing_source)
        self.health = Health(ctx)
        self.plan: FramePlan | None = None
        self._plan_key: object = None
        self._drawn_plan: FramePlan | None = None
        self._history: object = None
        self._drawn: Moment | None = None  # of the last frame, unless its history was dropped
        self._frame = 0
        self._progress = Progress()
        self.progress_callback: Callable[[str, float], None] | None = None
        self.cpu_ms = 0.0  # of this thread in the last `draw`, waits excluded
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
        now = Moment(camera, float(time_s) if self.scene.facts.objects else 0.0)
        before = self._drawn and self._drawn.camera
        if cut or (before and is_cut(before, camera, self.scene.facts, self.scene.near_plane, self.size)):
            self.reset()
        previous = self._begin_frame(view, now, settings)
        facts = self._facts(view, now, previous, settings, time_budget_ms)
        plan = self._planned(view, settings, facts)
        inputs = self._inputs(view, now, previous, settings, plan, time_budget_ms)
        self.scene.place(now.time_s, previous.time_s)
        if any(dict(call.defines).get("SHADOWS") for call in plan.calls):
            self.scene.update_shadow()
        self._frame_buffer.write(frame_block(inputs).tobytes())
        self.health.begin_frame(plan)
        for name in {b for call in plan.calls for b in call.step.fills}:
            self._targets.begin_buffer(name)
        for name in {t for call in plan.calls for t in call.writes if TARGETS[t].cleared}:
            self._targets.clear(name)
        for call in self._calls(plan):
            slice_begin = self._clock() if call.step.sliced and time_budget_ms is not None else 0.0
            with self.profiler.scope(call.step.name):
                self._run(call, inputs)
            self._ctx.memory_barrier()
            self.health.after(call, self._targets)
            if slice_begin:
                rows = (inputs.rows[1] - inputs.rows[0]) * settings.rays.samples_per_frame
                self._progress.learn(rows, self._clock() - slice_begin)
        self._end_frame(view, plan, inputs)
        self.cpu_ms = (time.thread_time() - begin_cpu) * 1e3
        return self._targets.texture("display")

    @property
    def size(self) -> tuple[int, int]:
        return self._targets.size

    def resize(self, size: tuple[int, int]) -> None:
        """Change the picture's size; everything accumulated is dropped."""
        if size != self._targets.size:
            self._targets.resize(size)
            self._plan_key = None  # what fitted at another size may not at this one
            self.reset()

    def reset(self) -> None:
        """Drop accumulated samples: the next frame starts afresh."""
        self._history = None

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
        a G-buffer.
        """
        width, height = self.size
        row = height - 1 - min(max(y, 0), height - 1)
        return float(self._targets.read("depth")[row, min(max(x, 0), width - 1), 0])

    @property
    def converged_samples(self) -> int:
        """Frames (or lens samples per pixel, for a running mean) accumulated so far."""
        return self._progress.samples if self._progress.samples else self._frame

    @property
    def timings(self) -> list[tuple[str, float]]:
        """(pass, median ms) of the current plan's passes, in frame order."""
        times = self.profiler.median_ms()
        return [(c.step.name, times[c.step.name]) for c in self.plan.calls if c.step.name in times] if self.plan else []

    @property
    def timing_source(self) -> str:
        return self.profiler.source

    @property
    def memory(self) -> dict[str, int]:
        """GPU bytes by target, block and scene resource."""
        return {**self._targets.bytes, **{f"scene: {name}": count for name, count in self.scene.bytes.items()}}

    def reload_shaders(self) -> str | None:
        """Re-read the shader files; returns an error's text, in which case the last good program goes on."""
        error = self._programs.reload()
        self.reset()
        return error

    def release(self) -> None:
        self._targets.release()
        self._programs.release()
        self.health.release()
        self._frame_buffer.release()

    # -- one frame -----------------------------------------------------------------------------------------------------

    def _begin_frame(self, view: str, now: Moment, settings: Settings) -> Moment:
        """What the frame before showed; `now` itself where the past does not count, which is then dropped."""
        key = (view, history_key(settings), self.size, id(self.scene))
        if key != self._history or (view in CONVERGING and now != self._drawn):
            self._history, self._frame, self._drawn = key, 0, None
            self._progress.restart()
            for name in CONVERGING if view in CONVERGING else ():
                self._targets.clear(name)
        previous = self._drawn or now
        self.moved = now != previous
        return previous

    def _facts(self, view: str, now: Moment, previous: Moment, settings: Settings, budget_ms: float | None) -> Facts:
        return frame_facts(
            self.scene.facts,
            now.camera,
            settings.lens,
            self.size,
            self.scene.near_plane,
            camera_moved=now.camera != previous.camera,
            objects_moved=now.time_s != previous.time_s,
            unsampled=view in LENS_RAYS and budget_ms is not None and self._progress.samples == 0,
        )

    def _planned(self, view: str, settings: Settings, facts: Facts) -> FramePlan:
        key = (view, settings, facts)
        if key != self._plan_key:
            plan = frame_plan(view, settings, facts)
            self._targets.reserve(plan.targets)
            if self.plan is None or [c.step.name for c in plan.calls] != [c.step.name for c in self.plan.calls]:
                self.profiler.reset()
            for target in plan.histories - (self.plan.histories if self.plan else frozenset()):
                self._targets.clear(target, previous=True)  # what it holds is older than last frame
            self.plan, self._plan_key = plan, key
        assert self.plan is not None
        return self.plan

    def _inputs(
        self,
        view: str,
        now: Moment,
        previous: Moment,
        settings: Settings,
        plan: FramePlan,
        time_budget_ms: float | None,
    ) -> FrameInputs:
        rows = 0, self.size[1]
        if time_budget_ms is not None and any(call.step.sliced for call in plan.calls):
            rows = self._progress.next_rows(self.size[1], settings.rays.samples_per_frame, time_budget_ms)
        return FrameInputs(
            now=now,
            previous=previous,
            settings=settings,
            size=self.size,
            frame_index=self._frame,
            seed=self.seed,
            near_plane=self.scene.near_plane,
            scene=self.scene,
            through_lens=view in LENS_POINTS,
            rows=rows,
            show=TARGETS[view] if view in TARGETS and view not in VIEWS else None,
        )

    def _calls(self, plan: FramePlan) -> tuple[Call, ...]:
        """What this frame runs. A continued slice starts at the sliced pass: nothing before it has changed since."""
        calls, continued = plan.calls, self._progress.row > 0 and plan is self._drawn_plan
        self._drawn_plan = plan
        return calls[next(i for i, call in enumerate(calls) if call.step.sliced) :] if continued else calls

    def _run(self, call: Call, inputs: FrameInputs) -> None:
        if call.step.rays:
            self.scene.ensure_bvh(self.progress_callback)
        for index, kernel in enumerate(call.step.kernels or ((),)):
            self._run_kernel(call, inputs, index, kernel)

    def _run_kernel(self, call: Call, inputs: FrameInputs, index: int, kernel: Defines) -> None:
        step = call.step
        defines = (*call.defines, *kernel, *(self.scene.defines.items() if step.scene else ()))
        compiled = self._programs.get(step.shader, defines, call.writes if step.kind == "raster" else ())
        check_names(call, compiled)
        bind(call, compiled, self._targets, self.scene, self._frame_buffer)
        if step.kind == "raster":
            self._targets.framebuffer(call.writes).use()
            self._ctx.enable_only(moderngl.DEPTH_TEST)
            self.scene.draw(compiled.program)
        elif step.indirect:
            buffer, offset = step.indirect
            compiled.program.run_indirect(self._targets.buffer(buffer), offset + 16 * index)
        else:
            grid = self._targets.texture(step.grid or call.writes[0])
            rows = inputs.rows[1] - inputs.rows[0] if step.sliced else grid.height
            compiled.program.run(math.ceil(grid.width / step.group[0]), math.ceil(rows / step.group[1]))

    def _clock(self) -> float:
        """Seconds, once the GPU has done all it was given."""
        self._ctx.finish()
        return time.perf_counter()

    def _end_frame(self, view: str, plan: FramePlan, inputs: FrameInputs) -> None:
        for target in {t for call in plan.calls for t in call.writes if TARGETS[t].history}:
            self._targets.swap(target)
        self.profiler.end_frame()
        self._drawn = inputs.now
        if inputs.rows[1] < self.size[1]:
            self._progress.row = inputs.rows[1]
            return
        self._progress.row = 0
        self._frame += 1
        if view in CONVERGING:
            self._progress.samples += inputs.settings.rays.samples_per_frame if view in LENS_RAYS else 1
