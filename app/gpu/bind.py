"""Gives every name that a pass' program uses its resource."""

from __future__ import annotations

import moderngl

from ..frame.records import Call
from .programs import Compiled
from .scene import GpuScene
from .targets import Targets

FRAME_BINDING = 0  # uniform block binding of FrameBlock


def bind(
    call: Call, compiled: Compiled, targets: Targets, scene: GpuScene | None, frame_block: moderngl.Buffer
) -> None:
    """Bind targets, last frame's targets, the scene's textures and storage blocks, and the frame's uniform block."""
    _bind_samplers(call, compiled, targets, scene)
    _bind_images(call, compiled, targets)
    blocks = {name: targets.buffer(name) for name in (*call.step.takes, *call.step.fills)}
    blocks |= scene.blocks if scene else {}
    for binding, name in enumerate(sorted(compiled.active & blocks.keys())):
        compiled.program[name].binding = binding
        blocks[name].bind_to_storage_buffer(binding)
    if "FrameBlock" in compiled.active:
        compiled.program["FrameBlock"].binding = FRAME_BINDING
        frame_block.bind_to_uniform_block(FRAME_BINDING)


def _bind_samplers(call: Call, compiled: Compiled, targets: Targets, scene: GpuScene | None) -> None:
    samplers = {f"in_{name}": targets.texture(target) for name, target in call.reads}
    samplers |= {f"prev_{target}": targets.texture(target, previous=True) for target in call.step.history}
    samplers |= scene.samplers if scene else {}
    for unit, name in enumerate(name for name in samplers if name in compiled.active):
        samplers[name].use(unit)
        compiled.program[name] = unit


def _bind_images(call: Call, compiled: Compiled, targets: Targets) -> None:
    if call.step.kind == "raster":
        return
    for image, target in enumerate(call.writes):
        if f"out_{target}" in compiled.active:
            in_place = target in (*call.step.updates, *call.in_place)
            targets.texture(target).bind_to_image(image, read=in_place, write=True)
            compiled.program[f"out_{target}"] = image
