"""While the window rests, programs are made ready that the next step can ask for, one a turn, so that it need not wait.

What traces rays is left alone until the scene's tree exists: nobody may ever ask for it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain

from ..frame.permutations import of_its_class, within_one_step
from ..frame.records import Call
from ..gpu.execute import formats, program_key
from ..gpu.programs import MOST_PROGRAMS, Formats
from ..gpu.shaders import Key, ShaderError
from ..panel.model import ProgramsShown
from .stage import Stage
from .state import State

LOOK_S = 0.004  # of a turn, for looking through the list: the window goes on answering


class WarmUp:
    """Goes through the programs within one step of what is shown, and begins anew where that changes."""

    def __init__(self, state: State, stage: Stage) -> None:
        self._state, self._stage = state, stage
        self._aim: object = None
        self._calls: Iterator[Call] = iter(())
        self._ready: set[tuple[Key, Formats]] = set()
        self._later: set[Key] = set()  # for rays
        self._done = True  # without a scene there is nothing to do

    @property
    def done(self) -> bool:
        """Whether everything within one step is ready."""
        self._take_aim()
        return self._done

    def turn(self) -> None:
        """Compile one program, or look for one for a moment."""
        self._take_aim()
        begin = time.perf_counter()
        while not (self._done or self._stage.rehearsal.spent) and time.perf_counter() - begin < LOOK_S:
            call = next(self._calls, None)
            self._done = call is None
            if call and self._prepare(call):
                return

    def shown(self) -> ProgramsShown:
        """For the panel."""
        programs = self._stage.rehearsal.programs
        ready = len({key for key, _ in self._ready})
        return ProgramsShown(len(programs), MOST_PROGRAMS, ready, len(self._later), self._done)

    def _take_aim(self) -> None:
        look, stage = self._state.look, self._stage
        if stage.gpu_scene is None:
            return
        views = (look.view, look.other) if look.compare else (look.view,)
        settings, facts = of_its_class(look.settings, stage.facts(look.settings, self._state.camera))
        aim = views, settings, facts, stage.edition, stage.gpu_scene.has_tree
        if aim != self._aim:
            self._aim, self._done = aim, False
            self._calls = chain.from_iterable(within_one_step(view, settings, facts) for view in views)
            self._ready.clear()
            self._later.clear()

    def _prepare(self, call: Call) -> bool:
        """Make it ready if it is not; True if that was work."""
        stage = self._stage
        assert stage.gpu_scene is not None
        rehearsal, scene = stage.rehearsal, stage.gpu_scene
        variant = program_key(rehearsal.programs, call, scene), formats(call)
        if call.step.rays and not scene.has_tree:
            self._later.add(variant[0])
            return False
        if variant in self._ready:
            return False
        was_ready = rehearsal.programs.has_run(*variant)
        with suppress(ShaderError):  # told when somebody asks for it
            look = self._state.look
            stage.sides[0].renderer.rehearse((call,), look.view, self._state.camera, look.settings)
        self._ready.add(variant)
        return not was_ready
