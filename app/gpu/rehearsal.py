"""Programs made ready before a picture needs them: each compiled and run once, on textures of a few texels.

A driver's compiler waits for the first run: of the 4 s that the hybrid view's programs take on llvmpipe, linking them
is 0.5. Renderers that share a rehearsal share its programs, and its allowance of so many a turn.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import moderngl

from ..frame.records import Call
from ..frame.targets import TARGETS
from .execute import formats, prepared, program_key, try_out
from .frame_block import FrameInputs, frame_block
from .layout import FRAME
from .programs import Programs
from .scene import GpuScene
from .targets import Targets

Size = tuple[int, int]
SCALES = sorted({target.scale for target in TARGETS.values()})


class Rehearsal:
    """Owns programs. `a_turn`: how many may become ready between two `begin_turn`; None: whoever draws does not ask,
    compiles on the spot and waits.
    """

    def __init__(self, ctx: moderngl.Context, a_turn: int | None = None) -> None:
        self._ctx, self.a_turn = ctx, a_turn
        self.programs = Programs(ctx)
        self._left = a_turn or 0
        self.part = 1.0  # of the programs last asked for, how many were ready
        self._targets: Targets | None = None
        self._frame_buffer = ctx.buffer(reserve=FRAME.itemsize)

    @property
    def patient(self) -> bool:
        """Whether pictures wait for programs and trees, instead of the window for the picture."""
        return self.a_turn is not None

    @property
    def spent(self) -> bool:
        """Whether nothing more may be compiled in this turn."""
        return self._left <= 0

    def begin_turn(self) -> None:
        """Grant the allowance of a turn."""
        self._left = self.a_turn or 0

    def missing(self, calls: Iterable[Call], scene: GpuScene) -> list[Call]:
        """The calls that would have to compile something, in order; each program once."""
        wanting = {(program_key(self.programs, call, scene), formats(call)): call for call in calls}
        return [call for variant, call in wanting.items() if not self.programs.has_run(*variant)]

    def ready(self, calls: Iterable[Call], scene: GpuScene, inputs: FrameInputs) -> bool:
        """Whether these calls can run without compiling, after as much of it as the turn's allowance permits.

        `inputs` are the frame's. What traces rays has to wait for the scene's tree, which it does not ask for. Raises
        ShaderError.
        """
        calls = tuple(calls)
        missing = self.missing(calls, scene)
        while missing and not self.spent:
            possible = [call for call in missing if scene.has_tree or not call.step.rays]
            if not possible:
                break
            self._left -= 1
            self._try(possible[0], scene, inputs)
            missing.remove(possible[0])
        self.part = 1.0 - len(missing) / max(len(calls), 1)
        if not missing and any(call.shadowed for call in calls) and scene.sun and not scene.shadow.renders:
            if self.spent:
                return False
            self._left -= 1
            scene.update_shadow(self.programs)
        return not missing

    def affords(self, shader: str) -> bool:
        """Whether a program outside of plans may be used now: it is there, or this turn may compile it."""
        if not self.patient or self.programs.holds(shader):
            return True
        affordable = not self.spent
        self._left -= affordable
        return affordable

    def release(self) -> None:
        """Free programs and textures."""
        self.programs.release()
        self._frame_buffer.release()
        if self._targets:
            self._targets.release()

    def _try(self, call: Call, scene: GpuScene, inputs: FrameInputs) -> None:
        small = like(inputs.size)
        if self._targets is None:
            self._targets = Targets(self._ctx, small)
        elif self._targets.size != small:
            self._targets.resize(small)
        self._frame_buffer.write(frame_block(replace(inputs, size=small, rows=(0, small[1]))).tobytes())
        for name in (*call.step.takes, *call.step.fills):
            self._targets.buffer(name).clear()  # else a work list could be of any length
        compiled = prepared(self.programs, call, self._targets, scene, self._frame_buffer)
        try_out(self._ctx, call, compiled, self._targets, scene)
        self._ctx.memory_barrier()
        self._ctx.finish()


def like(size: Size) -> Size:
    """The smallest picture [px] that a driver compiles for as it does for this one: llvmpipe makes other code for
    textures whose sides are powers of two.
    """
    width, height = (next(n for n in range(1, side + 1) if _powers(n) == _powers(side)) for side in size)
    return width, height


def _powers(side: int) -> tuple[bool, ...]:
    """Whether it is a power of two at each scale."""
    at_scales = (-(-side // scale) for scale in SCALES)
    return tuple(n & (n - 1) == 0 for n in at_scales)
