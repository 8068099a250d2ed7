"""A flight through everything the window can do, by a seeded script: scenes, views, sizes, settings, shader reloads.

What it stands on is the window's own stage and surveyor, without a window. All it draws is small.
"""

from __future__ import annotations

import random
from dataclasses import replace
from enum import Enum
from pathlib import Path

import moderngl

from app.controls import Pilot
from app.errors import UserError
from app.frame.pipeline import VIEWS
from app.frame.targets import TARGETS
from app.panel.model import Look, Shown
from app.session import focused
from app.settings import Settings, put, walk
from app.window.stage import Stage
from app.window.state import State
from app.window.surveyor import STILL_S, Surveyor
from app.window.warmup import WarmUp

HOME_SCENE, HOME_SIZE = "stress:knife-edges", (80, 45)
SCENES = ("stress:one-triangle", "stress:mirrors", "stress:knife-edges", "stress:empty", "toy-train")
SIZES = ((96, 64), (64, 96), (33, 17), (97, 61), (1, 1), (1, 40))
TARGET_VIEWS = [name for name in TARGETS if name not in VIEWS and name not in ("display", "resolved")]
KEYS = ("w", "a", "s", "d", "e", "q")
FRAME_S = 1.0 / 30.0
# Settings whose cost grows with their value: a frame of this size must stay a matter of milliseconds.
MOST = {"rays.budget": 4.0, "rays.max_per_pixel": 8, "rays.samples_per_frame": 2, "lens.aperture": 0.3}


class Flight:
    """One user who never sits still. Each `frame` draws one; `home` goes back to one known state."""

    def __init__(self, ctx: moderngl.Context, shaders: Path, haste: float = 1.0) -> None:
        """`shaders`: a folder that the program reads its shaders from, which the flight may write to. `haste`: how many
        times as often something is done as in a long flight.
        """
        self.ctx, self.random, self.haste = ctx, random.Random(0), haste
        self.stage = Stage(ctx, lambda text, fraction: None)
        self.state = State(Look(view="sharp"), Shown())
        self.surveyor = Surveyor(self.state, self.stage)
        self.warm_up = WarmUp(self.state, self.stage)
        self.size, self.clock = HOME_SIZE, 0.0
        self.done: dict[str, int] = {}
        self.broken = 0  # readings of shaders that did not compile
        self._entry = shaders / "shared" / "frame.glsl"  # of which nearly every shader is made
        self._text = self._entry.read_text(encoding="utf-8")
        self.load(HOME_SCENE)

    def begin(self, seed: int) -> None:
        """From `home`, the same seed does the same again."""
        self.random, self.done = random.Random(seed), {}

    def frame(self) -> None:
        """Maybe do something, then draw."""
        for chance, deed in (
            (0.05, self._look_at_another_view),
            (0.05, self._change_a_setting),
            (0.03, self._change_the_size),
            (0.10, self._press_or_let_go),
            (0.01, self._split_the_screen),
            (0.01, self._measure),
            (0.005, self._load_another_scene),
            (0.004, self._reload),
            (0.02, self._cut),
        ):
            if self.random.random() < self.haste * chance:
                self._count(deed.__name__.strip("_"))
                deed()
        self._draw()

    def home(self) -> None:
        """The state that the flight began in, whatever it has been through. Who measured begins anew."""
        self._write("")
        self._read_shaders()
        self.state.look = Look(view="sharp")
        self.state.pilot = Pilot()
        self.surveyor.release()
        self.surveyor = Surveyor(self.state, self.stage)
        self.load(HOME_SCENE)
        for size in ((16, 9), HOME_SIZE):  # a change of size drops all targets but those of the view
            self.size = size
            self._draw()
            while self.stage.preparing:
                self._draw()
        scratch = self.stage.rehearsal._targets  # what programs were tried out on last, which depends on the clock
        if scratch:
            scratch.release()

    def load(self, name: str) -> None:
        """As the window does it (app/window/requests.py)."""
        self.stage.load(name)
        start = self.random.choice(self.stage.viewpoints)
        self.state.camera = start.camera
        self.state.look = replace(self.state.look, settings=focused(self.state.look.settings, start))
        self.state.pilot.speed = max(self.stage.extent / 8.0, 1e-3)
        self.state.time_s = 0.0

    def release(self) -> None:
        """Free all that it holds on the GPU."""
        self._write("")
        self.surveyor.release()
        self.stage.release()

    def _draw(self) -> None:
        """One turn of the window's loop (app/window/loop.py)."""
        state, stage = self.state, self.stage
        self.clock += FRAME_S if state.pilot.active else STILL_S
        state.camera = state.pilot.advance(state.camera, FRAME_S)
        if stage.moves:
            state.pass_time(FRAME_S)
        stage.rehearsal.begin_turn()
        _, converging = stage.pending(state.look, state.camera, self.size, state.time_s)
        if self.surveyor.turn(self.size, self.clock, converging):
            self._count("slices with the map" if state.look.heat else "slices of the survey")
        try:
            stage.draw(state.look, state.camera, self.size, state.time_s)
            self._count("stand-ins" if stage.preparing else "pictures")
        except UserError:  # a target that these settings do not make
            self._count("refused")
            state.look = replace(state.look, view="sharp", compare=False)
        if stage.rehearsal.patient and not state.pilot.active:
            self.warm_up.turn()
        self.surveyor.shown()
        for side in stage.sides:
            self.surveyor.texture(side)

    def _look_at_another_view(self) -> None:
        view = self.random.choice(self.random.choice((list(VIEWS), TARGET_VIEWS)))
        self.state.look = replace(self.state.look, view=view)

    def _change_a_setting(self) -> None:
        path, leaf, old = self.random.choice(list(walk(Settings())))
        low, high = leaf.metadata["low"], leaf.metadata["high"]
        value = {
            bool: lambda: self.random.random() < 0.5,
            int: lambda: self.random.randint(low, MOST.get(path, high)),
            float: lambda: self.random.uniform(low, MOST.get(path, high)),
            tuple: lambda: tuple(self.random.random() for _ in old),
        }.get(type(old), lambda: self.random.choice(list(type(old)) if isinstance(old, Enum) else [old]))()
        self.state.look = replace(self.state.look, settings=put(self.state.look.settings, path, value))

    def _change_the_size(self) -> None:
        self.size = self.random.choice(SIZES)

    def _press_or_let_go(self) -> None:
        key = self.random.choice(KEYS)
        self.random.choice((self.state.pilot.press, self.state.pilot.release, self.state.pilot.release))(key)
        self.state.pilot.look(self.random.gauss(0.0, 40.0), self.random.gauss(0.0, 20.0))

    def _split_the_screen(self) -> None:
        look = self.state.look
        self.state.look = replace(look, compare=not look.compare, other=self.random.choice(list(VIEWS)))

    def _measure(self) -> None:
        look = self.state.look
        self.state.pilot.let_go()
        if self.random.random() < 0.5:
            self.state.look = replace(look, heat=not look.heat)
        else:
            self.state.look = replace(look, survey=replace(look.survey, open=not look.survey.open, width=32))

    def _load_another_scene(self) -> None:
        self.load(self.random.choice(SCENES))

    def _reload(self) -> None:
        self._write(self.random.choice(("", "\n// edited\n", "\n// and again\n", "\nthis is no GLSL\n")))
        self._read_shaders()

    def _read_shaders(self) -> None:
        if self.stage.reload_shaders():
            self.broken += 1

    def _cut(self) -> None:
        self.state.camera = self.random.choice(self.stage.viewpoints).camera

    def _write(self, more: str) -> None:
        self._entry.write_text(self._text + more, encoding="utf-8")

    def _count(self, what: str) -> None:
        self.done[what] = self.done.get(what, 0) + 1
