"""Runs a pass that needs no scene, bound and dispatched as the renderer does it."""

from __future__ import annotations

import moderngl

from app.frame.records import Call
from app.frame.targets import TARGETS
from app.gpu.execute import execute, prepared
from app.gpu.programs import Programs
from app.gpu.targets import Targets


def run_call(ctx: moderngl.Context, call: Call, programs: Programs, targets: Targets, block: moderngl.Buffer) -> None:
    """One call of a plan; `block` is the frame's uniform block."""
    for target in call.writes:
        if TARGETS[target].cleared:
            targets.clear(target)
    for part in call.parts:
        compiled = prepared(programs, part, targets, None, block)
        execute(ctx, part, compiled, targets, None, (0, 0))
    ctx.memory_barrier()
