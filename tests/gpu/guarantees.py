"""What every OpenGL 4.3 driver grants at least (core specification 4.3, tables 23.58 to 23.75), and what one program
takes of it.
"""

from __future__ import annotations

from collections import Counter

import moderngl

from app.frame.records import Call
from app.gpu.programs import Compiled

# a stage's samplers, images, storage blocks, uniform blocks; attributes, fragment outputs
GRANTED = {"samplers": 16, "images": 8, "storage blocks": 8, "uniform blocks": 12, "attributes": 16, "outputs": 8}
# Images, storage blocks and fragment outputs of a program together: 8 are granted, but every known driver for desktop
# GPUs has 16 or more, and a program that takes too many ends in its linker's sentence.
WRITABLE = 16

_IMAGES = range(0x904C, 0x906D)  # GL_IMAGE_1D to GL_UNSIGNED_INT_IMAGE_2D_MULTISAMPLE_ARRAY


def taken(call: Call, compiled: Compiled) -> Counter[str]:
    """How many of each a pass' program takes."""
    found: Counter[str] = Counter()
    for name in compiled.program:
        member = compiled.program[name]
        if isinstance(member, moderngl.StorageBlock):
            found["storage blocks"] += 1
        elif isinstance(member, moderngl.UniformBlock):
            found["uniform blocks"] += 1
        elif isinstance(member, moderngl.Attribute):
            found["attributes"] += 1
        elif isinstance(member, moderngl.Uniform) and member.gl_type in _IMAGES:
            found["images"] += member.array_length
        elif isinstance(
            member, moderngl.Uniform
        ):  # a pass has no uniforms but samplers and images: all else is a block's
            found["samplers"] += member.array_length
    found["outputs"] = len(call.writes) if call.step.kind == "raster" else 0
    return found


def check_granted(call: Call, compiled: Compiled) -> None:
    """Fail if a pass needs more than a driver must have."""
    found = taken(call, compiled)
    more = {what: count for what, count in found.items() if count > GRANTED[what]}
    assert not more, f"{call.step.name} takes {more}"
    writable = found["images"] + found["storage blocks"] + found["outputs"]
    assert writable <= WRITABLE, f"{call.step.name} takes {writable} resources that can be written"
