"""Runs one call of a plan: its program over its texels, its work list, or the scene's triangles."""

from __future__ import annotations

import math

import moderngl

from ..frame.records import Call
from ..frame.targets import TARGETS
from .bind import bind
from .programs import Compiled, Formats, Programs, check_names
from .scene import GpuScene
from .shaders import Key
from .targets import Targets

Rows = tuple[int, int]


def program_key(programs: Programs, call: Call, scene: GpuScene | None) -> Key:
    """What a call's program is filed under, with what this scene adds to its defines."""
    shader, defines, outputs = call.program
    return programs.key(shader, (*defines, *scene.defines.items()) if call.step.scene and scene else defines, outputs)


def formats(call: Call) -> Formats:
    """Of the textures that a call reads and writes."""
    touched = (*(target for _, target in call.reads), *call.step.history, *call.writes)
    return tuple(f"{t.components}{t.dtype}{t.filter}" for t in (TARGETS[name] for name in touched))


def prepared(
    programs: Programs, call: Call, targets: Targets, scene: GpuScene | None, frame_block: moderngl.Buffer
) -> Compiled:
    """A call's program, compiled, checked against the pass, and bound to all that it reads and writes."""
    compiled = programs.get(*program_key(programs, call, scene))
    check_names(call, compiled)
    bind(call, compiled, targets, scene, frame_block)
    programs.runs(compiled, formats(call))
    return compiled


def run_call(
    ctx: moderngl.Context,
    call: Call,
    programs: Programs,
    targets: Targets,
    scene: GpuScene | None,
    frame_block: moderngl.Buffer,
    rows: Rows = (0, 0),
) -> None:
    """Run all parts of a call over cleared targets where it draws only parts of them. A sliced pass covers `rows` of
    its grid, first and one past the last. What comes after must wait for it (memory barrier).
    """
    for target in call.writes:
        if TARGETS[target].cleared:
            targets.clear(target)
    for part in call.parts:
        compiled = prepared(programs, part, targets, scene, frame_block)
        _execute(ctx, part, compiled, targets, scene, rows)


def _execute(
    ctx: moderngl.Context, call: Call, compiled: Compiled, targets: Targets, scene: GpuScene | None, rows: Rows
) -> None:
    """Run what is prepared."""
    step = call.step
    if step.kind == "raster":
        _raster(ctx, call, compiled, targets, scene)
    elif call.counts:
        buffer, offset = call.counts
        compiled.program.run_indirect(targets.buffer(buffer), offset)
    else:
        grid = targets.texture(step.grid or call.writes[0])
        height = rows[1] - rows[0] if step.sliced else grid.height
        compiled.program.run(math.ceil(grid.width / step.group[0]), math.ceil(height / step.group[1]))


def try_out(ctx: moderngl.Context, call: Call, compiled: Compiled, targets: Targets, scene: GpuScene | None) -> None:
    """Run as little of it as makes a driver compile all of it: one work group, or one triangle. A work list may be
    empty: its shader looks at the length.
    """
    if call.step.kind == "raster":
        _raster(ctx, call, compiled, targets, scene, vertices=3)
    else:
        compiled.program.run(1)


def _raster(
    ctx: moderngl.Context, call: Call, compiled: Compiled, targets: Targets, scene: GpuScene | None, vertices: int = -1
) -> None:
    assert scene is not None, "a raster pass draws a scene"
    targets.framebuffer(call.writes).use()
    ctx.enable_only(moderngl.DEPTH_TEST)
    scene.draw(compiled.program, vertices)
