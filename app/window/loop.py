"""The window's loop: requests, camera, scene, panel, in that order, and rest when nothing changes."""

from __future__ import annotations

import math
import time
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from imgui_bundle import imgui, implot

from ..camera import Viewpoint
from ..errors import UserError
from ..frame.pipeline import check_view
from ..gpu.context import device_name
from ..gpu.imgui import ImguiRenderer
from ..gpu.present import Presenter
from ..panel import style
from ..panel.model import Look, Shown
from ..panel.panel import Panel, first_width
from ..scene.load import scene_file
from ..settings import Settings
from .desktop import Desktop
from .events import Events
from .remembered import ini_file
from .requests import Requests
from .stage import Stage
from .state import State
from .status import StatusLog
from .surveyor import UI_S, Surveyor
from .telling import readiness, telling, title
from .warmup import WarmUp

SETTLE_S = (
    0.2  # the picture is scaled until a new size has stood this long: drawing every step of a drag would stall it
)
QUIET_S = 0.15  # after input, frames that only refine the picture wait this long, so that the panel answers at once
PROGRESS_S = 0.1  # between two drawings of the progress bar: loading should load
REST_S = 0.5  # longest sleep of a resting window: some systems do not wake it to be interrupted
BUILDING_S = 0.1  # the same while a thread builds: between two drawings of its progress
COMPILES = 1  # programs a turn: no frame stalls for more
BACKGROUND = (0.05, 0.05, 0.05)
CURSORS: dict[int, str] = {
    imgui.MouseCursor_.text_input: "text",
    imgui.MouseCursor_.resize_ew: "size_left_right",
    imgui.MouseCursor_.hand: "hand",
}


class _ClosedWhileLoading(Exception):
    """The window was closed while a scene loaded: leave loading at once."""


def open_window(
    scene: str,
    view: str,
    size: tuple[int, int],
    settings: Settings,
    viewpoint: Viewpoint | None,
    given: Mapping[str, Any],
    options: Namespace,
) -> int:
    """Show `scene` in a window until it is closed; returns the exit code.

    `size` is the picture's; the panel stands beside it. `given` are settings that the user chose, which win over what a
    viewpoint brings. `options` has `status` (file for JSON lines, or None) and `screenshots` (folder).
    Raises UserError: no display (exit code 3), a bad scene or view (exit code 2).
    """
    check_view(view)  # what is misspelt is refused before a window flashes up, and where there is no display
    scene_file(scene)
    status = StatusLog(options.status)
    desktop = Desktop("hybrid-dof", (size[0] + math.ceil(first_width(1.0)), size[1]))
    try:
        window = Window(desktop, Look(settings, view), given, Path(options.screenshots), status)
        try:
            window.run(scene, viewpoint, size)
        finally:
            window.release()
    finally:
        desktop.close()
        status.close()
    return 0


class Window:
    """Owns ImGui, the stage and the loop over them."""

    def __init__(
        self, desktop: Desktop, look: Look, given: Mapping[str, Any], screenshots: Path, status: StatusLog
    ) -> None:
        self._desktop, self._status = desktop, status
        imgui.create_context()
        implot.create_context()
        imgui.get_io().set_ini_filename(ini_file())
        imgui.get_io().config_input_text_cursor_blink = False  # a resting window draws nothing
        style.apply(desktop.density)
        self._state = State(look, Shown(device=device_name(desktop.ctx)), given)
        self._stage = Stage(desktop.ctx, self._on_progress, COMPILES)
        self._surveyor = Surveyor(self._state, self._stage)
        self._warm_up = WarmUp(self._state, self._stage)
        self._panel = Panel()
        self._events = Events(desktop, self._state, self._stage, self._panel, self._digest)
        self._requests = Requests(self._state, self._stage, screenshots)
        self._imgui, self._presenter = ImguiRenderer(desktop.ctx), Presenter(desktop.ctx)
        self._size, self._wanted_size, self._size_since = (0, 0), (0, 0), 0.0
        self._last_ui = self._last_step = time.perf_counter()
        self._last_progress = 0.0
        self._frames = 0
        self._outdated = False  # what the panel tells is no longer so
        self._good_view = look.view
        desktop.listen(self._events)

    def run(self, scene: str, viewpoint: Viewpoint | None, size: tuple[int, int]) -> None:
        """Load `scene` and serve the window until it is closed. Raises UserError if the scene cannot be loaded."""
        self._frame_ui()  # tells how wide the panel is
        self._fit_window(size)
        try:
            self._requests.load(scene, viewpoint)
            self._last_step = time.perf_counter()
            while not self._desktop.closing:
                self._turn()
        except _ClosedWhileLoading:
            pass

    def release(self) -> None:
        """Free everything on the GPU and ImGui's context."""
        self._requests.stop()
        self._surveyor.release()
        self._stage.release()
        self._presenter.release()
        self._imgui.release()
        implot.destroy_context()
        imgui.destroy_context()

    def _turn(self) -> None:
        state = self._state
        for request in state.take_requests():
            self._requests.serve(request)
        now = time.perf_counter()
        state.camera = state.pilot.advance(state.camera, now - self._last_step)
        if self._stage.moves:
            state.pass_time(now - self._last_step)
        self._last_step = now
        self._settle_size(now)
        self._stage.begin_turn()
        advising = self._requests.advance()
        changed, converging = self._stage.pending(state.look, state.camera, self._size, state.time_s)
        if not changed and not advising and self._surveyor.turn(self._size, now, converging):
            self._outdated = True
            if now > state.awake_until and now - self._last_ui < UI_S:
                self._desktop.pull_events()
                return
        elif changed or (converging and not advising and now - state.last_input > QUIET_S):
            self._draw_scene(now)
            self._surveyor.drawn(time.perf_counter() - now)
            if not changed and now > state.awake_until:
                self._warm_up.turn()
        elif not advising and now > state.awake_until and not self._has_news(now):
            self._rest(now)
            return
        self._frame_ui()
        if self._stage.building and (self._stage.idle or not changed):
            self._desktop.wait(BUILDING_S)

    def _has_news(self, now: float) -> bool:
        """Whether the panel, as it was last drawn, tells what is no longer so."""
        return self._outdated or self._panel.effects.fading or self._last_ui < self._state.message_until <= now

    def _rest(self, now: float) -> None:
        """Nothing is to be drawn: compile one program for the next step, else wait until something is to be done."""
        if not self._warm_up.done:
            self._warm_up.turn()
            self._outdated = self._warm_up.done
            self._desktop.pull_events()
            return
        until = [REST_S, *(at - now for at in (self._state.message_until, self._size_since + SETTLE_S) if at > now)]
        self._desktop.wait(BUILDING_S if self._stage.building else min(until))

    def _draw_scene(self, begin: float) -> None:
        state = self._state
        try:
            self._stage.draw(state.look, state.camera, self._size, state.time_s)
        except UserError as error:
            state.say(str(error))
            state.look = self._without_culprit(state.look)
            return
        if not self._stage.preparing:
            self._good_view = state.look.view
        self._desktop.ctx.finish()  # else a slow device would queue up frames ahead of the events
        state.shown = replace(state.shown, frame_ms=(time.perf_counter() - begin) * 1e3)

    def _without_culprit(self, look: Look) -> Look:
        """What to show when a view cannot be drawn: the left alone, else the last good view, else the sharp one."""
        if look.compare:
            return replace(look, compare=False)
        return replace(look, view=self._good_view if look.view != self._good_view else "sharp")

    def _frame_ui(self) -> None:
        """Put pictures and panel on the window."""
        buffer = self._desktop.buffer_size
        self._draw_panel()
        imgui.render()
        screen = self._desktop.screen
        screen.use()
        screen.viewport = (0, 0, *buffer)
        screen.clear(*BACKGROUND)
        self._show_pictures(buffer)
        screen.viewport = (0, 0, *buffer)
        self._imgui.render(imgui.get_draw_data())
        self._desktop.set_title(title(self._state.look, self._stage))
        self._desktop.set_cursor("size_left_right" if self._events.on_bar else CURSORS.get(imgui.get_mouse_cursor()))
        self._frames += 1
        self._log()
        self._desktop.swap()

    def _draw_panel(self) -> None:
        """One frame of ImGui's logic: input in, wishes out."""
        state, size, buffer = self._state, self._desktop.size, self._desktop.buffer_size
        now, io = time.perf_counter(), imgui.get_io()
        io.display_size = imgui.ImVec2(*size)
        io.display_framebuffer_scale = imgui.ImVec2(buffer[0] / max(size[0], 1), buffer[1] / max(size[1], 1))
        io.delta_time = max(now - self._last_ui, 1e-4)
        self._last_ui, self._outdated = now, False
        imgui.new_frame()
        shown = telling(state, self._stage, self._surveyor, self._warm_up, self._requests.ledger, now)
        state.look, requests = self._panel.draw(state.look, shown, size)
        state.requests += requests

    def _digest(self) -> None:
        """Let ImGui see one event without drawing."""
        self._draw_panel()
        imgui.end_frame()

    def _show_pictures(self, buffer: tuple[int, int]) -> None:
        textures = [shown for side in self._stage.sides if (shown := self._surveyor.texture(side))]
        if textures:
            x, y, width, height = self._panel.picture(self._desktop.size)
            scale = buffer[0] / max(self._desktop.size[0], 1)
            rect = (
                round(x * scale),
                buffer[1] - round((y + height) * scale),
                round(width * scale),
                round(height * scale),
            )
            right = textures[1] if len(textures) > 1 and self._state.look.compare else None
            self._presenter.show(textures[0], right, self._state.look.bar, rect, self._desktop.screen)

    def _log(self) -> None:
        """Note what is about to be shown; events that arrive with the swap belong to the next frame."""
        own = {"frame": self._frames, "size": list(self._size), "window": list(self._desktop.size)}
        of_stage = readiness(self._stage, self._warm_up)
        measured = self._surveyor.log_entry(self._panel.cost.places)
        self._status.write({**own, **of_stage, **self._state.log_entry(), **measured}, self._state.say)

    def _fit_window(self, size: tuple[int, int]) -> None:
        """Make the picture, not the window, as large as asked for: a remembered panel may be wider than the first."""
        _, _, width, height = self._panel.picture(self._desktop.size)
        if (round(width), round(height)) != size:
            self._desktop.resize((size[0] + math.ceil(self._panel.width), size[1]))
        self._size = self._wanted_size = size

    def _settle_size(self, now: float) -> None:
        """Follow the window's size, its density and the chosen resolution, once they have stopped changing."""
        _, _, width, height = self._panel.picture(self._desktop.size)
        scale = self._desktop.buffer_size[0] / max(self._desktop.size[0], 1) * self._state.look.scale
        wanted = (max(round(width * scale), 1), max(round(height * scale), 1))
        if wanted != self._wanted_size:
            self._wanted_size, self._size_since = wanted, now
        elif wanted != self._size and now - self._size_since > SETTLE_S:
            self._size = wanted

    def _on_progress(self, stage: str, fraction: float) -> None:
        """Keep the window alive while a scene loads; closing it ends that."""
        now = time.perf_counter()
        if now - self._last_progress >= PROGRESS_S:
            self._last_progress = now
            self._show_progress(stage, fraction)
            if self._desktop.closing:
                raise _ClosedWhileLoading

    def _show_progress(self, stage: str, fraction: float) -> None:
        self._state.shown = replace(self._state.shown, loading=(stage, fraction))
        self._frame_ui()
        self._state.shown = replace(self._state.shown, loading=None)
