"""What keys and panel ask for and only the window can do: load, reload, save. A failure becomes a message."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from ..camera import Viewpoint, camera_values, write_viewpoint
from ..errors import UserError
from ..files import is_folder, user_path
from ..panel.model import Request
from ..picture import write_png
from ..presets import SUFFIX, is_preset, preset_of, read_preset, without_viewpoint, write_preset
from ..session import focused
from ..settings import put, to_dict
from .advisor import Advisor
from .ledger import Ledger
from .stage import Stage
from .state import State

CROSSING_S = 8.0  # the first fly speed crosses the scene in this time


class Requests:
    """Serves one request after another, between frames."""

    def __init__(self, state: State, stage: Stage, screenshots: Path) -> None:
        self._state, self._stage, self._screenshots = state, stage, screenshots
        self.advisor, self.ledger = Advisor(state, stage), Ledger(state, stage)

    def advance(self) -> bool:
        """One frame of what goes on beside the picture; False where nothing does."""
        return self.advisor.advance() or self.ledger.advance()

    def stop(self) -> None:
        """End what goes on beside the picture."""
        self.advisor.stop()
        self.ledger.stop()

    def serve(self, request: Request) -> None:
        """Do it, or say why not."""
        try:
            if request.wish == "load":
                self._load_or_tell(request.text)
            elif request.wish == "viewpoint" and request.viewpoint:
                self._go_to(request.viewpoint)
            elif request.wish == "reload":
                self._reload()
            elif request.wish == "screenshot":
                self._screenshot()
            elif request.wish == "save camera":
                self._save_camera()
            elif request.wish in ("save preset", "load preset"):
                self._preset_or_tell(request)
            elif request.wish == "advise":
                self.advisor.start(request.text, request.number)
            elif request.wish == "stop advice":
                self.advisor.stop()
            elif request.wish == "measure savings":
                self.ledger.start()
            elif request.wish == "fit range":
                self._fit_range()
        except UserError as error:
            self._state.say(str(error))

    def load(self, name: str, viewpoint: Viewpoint | None = None) -> None:
        """Load a scene and stand at `viewpoint`, else at its first. Raises UserError; the old scene then stays."""
        state = self._state
        self.stop()  # they draw the scene that goes
        try:
            self._stage.load(name)
        finally:
            state.shown = replace(state.shown, loading=None)
        state.shown = replace(state.shown, load_error="")
        state.pilot.speed = max(self._stage.extent / CROSSING_S, 1e-3)
        start = viewpoint or self._stage.viewpoints[0]
        state.camera = start.camera
        # Focus and aperture that it does not name are at their defaults, as for `shot`: those of the scene before may
        # be of another scale.
        state.look = replace(state.look, settings=focused(without_viewpoint(state.look.settings), start, state.given))
        state.playing, state.time_s = True, 0.0
        state.given = {}  # options choose the start, not every later scene

    def _load_or_tell(self, name: str) -> None:
        try:
            self.load(name)
        except UserError as error:
            self._state.shown = replace(self._state.shown, load_error=str(error))
            raise

    def _go_to(self, viewpoint: Viewpoint) -> None:
        self._state.camera = viewpoint.camera
        self._state.look = replace(self._state.look, settings=focused(self._state.look.settings, viewpoint))

    def _reload(self) -> None:
        error = self._stage.reload_shaders()
        self._state.shown = replace(self._state.shown, shader_error=error)
        self._state.say("a shader was not reloaded: see the panel" if error else "shaders reloaded")

    def _screenshot(self) -> None:
        look, camera = self._state.look, self._state.camera
        facts = {
            "scene": self._stage.name,
            "view": look.view,
            "other": look.other if look.compare else None,
            "samples": [cost.samples for cost in self._stage.costs()],
            "time": self._state.time_s,
            "camera": camera_values(camera),
            "settings": to_dict(look.settings),
        }
        path = self._new_file(".png")
        write_png(path, self._stage.picture(look), facts)
        self._state.say(f"saved {path}")

    def _save_camera(self) -> None:
        lens, path = self._state.look.settings.lens, self._new_file(".json")
        write_viewpoint(path, Viewpoint(self._state.camera, lens.focus_distance, lens.aperture))
        self._state.say(f"saved {path}")

    def _preset_or_tell(self, request: Request) -> None:
        """A name without a folder lies where screenshots go, and one without a suffix is a .json."""
        path = self._screenshots / user_path(request.text)
        path = path if path.suffix else path.with_name(path.name + SUFFIX)
        state = self._state
        try:
            self._save_preset(path) if request.wish == "save preset" else self._load_preset(path)
        except UserError as error:
            state.shown = replace(state.shown, preset_error=str(error))
            raise
        state.shown = replace(state.shown, preset_error="")

    def _save_preset(self, path: Path) -> None:
        if path.suffix.lower() != SUFFIX:
            raise UserError(f"preset {path}: name a file ending in {SUFFIX}")
        if os.path.lexists(path) and not is_preset(path):
            raise UserError(f"{path} is there and is no preset; choose another name")
        write_preset(path, preset_of(self._state.look.settings, self._state.look.view))
        self._state.say(f"saved {path}")

    def _load_preset(self, path: Path) -> None:
        preset, look = read_preset(path), self._state.look
        self._state.look = replace(look, settings=preset.applied(look.settings), view=preset.view or look.view)
        self._state.say(f"loaded {path}")

    def _fit_range(self) -> None:
        found = self._stage.fitted_range(self._state.look)
        if found:
            settings = put(self._state.look.settings, "overlay.range_low", found[0])
            self._state.look = replace(self._state.look, settings=put(settings, "overlay.range_high", found[1]))

    def _new_file(self, suffix: str) -> Path:
        """A path that is not taken: scene-view.png, scene-view-2.png, ..."""
        if not is_folder(self._screenshots):
            raise UserError(f"--screenshots {self._screenshots}: there is no such folder")
        scene = Path(self._stage.name).stem.replace(":", "-")  # of a stress scene's name; not every system allows it
        stem, number = f"{scene}-{self._state.look.view}", 1
        while (path := self._screenshots / f"{stem}{'' if number == 1 else f'-{number}'}{suffix}").exists():
            number += 1
        return path
