"""Runs a pass that needs no scene, as the renderer does it."""

from __future__ import annotations

import moderngl

from app.frame.records import Call
from app.gpu import execute
from app.gpu.programs import Programs
from app.gpu.targets import Targets


def run_call(ctx: moderngl.Context, call: Call, programs: Programs, targets: Targets, block: moderngl.Buffer) -> None:
    """One call of a plan; `block` is the frame's uniform block."""
    execute.run_call(ctx, call, programs, targets, None, block)
    ctx.memory_barrier()
