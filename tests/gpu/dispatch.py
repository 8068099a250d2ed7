"""Runs a pass that needs no scene, bound and dispatched as the renderer does it."""

from __future__ import annotations

import moderngl

from app.frame.records import Call
from app.gpu.bind import bind
from app.gpu.programs import Programs, check_names
from app.gpu.targets import Targets


def run_call(ctx: moderngl.Context, call: Call, programs: Programs, targets: Targets, block: moderngl.Buffer) -> None:
    """One call of a plan; `block` is the frame's uniform block."""
    step = call.step
    for index, kernel in enumerate(step.kernels or ((),)):
        compiled = programs.get(step.shader, (*call.defines, *kernel))
        check_names(call, compiled)
        bind(call, compiled, targets, None, block)
        if step.indirect:
            buffer, offset = step.indirect
            compiled.program.run_indirect(targets.buffer(buffer), offset + 16 * index)
        else:
            grid = targets.texture(step.grid or call.writes[0])
            compiled.program.run(-(-grid.width // step.group[0]), -(-grid.height // step.group[1]))
    ctx.memory_barrier()
