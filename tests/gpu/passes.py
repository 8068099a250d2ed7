"""`run_pass`: one compute pass by itself on arrays, bound by name as the renderer does it."""

from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from app.gpu.layout import FRAME
from app.gpu.shaders import assemble, load_glsl

_DTYPE = {"float16": "f2", "float32": "f4", "uint8": "f1"}


def run_pass(
    ctx: moderngl.Context,
    shader: str,
    inputs: Mapping[str, np.ndarray],
    output: tuple[str, str, int],
    frame: Mapping[str, object],
    defines: Mapping[str, object] | None = None,
    before: np.ndarray | None = None,
) -> np.ndarray:
    """Run `shader` over `inputs` (sampler name -> (h, w, c)); `output` is (image name, dtype, components).

    `frame` sets fields of the uniform block, matrices as GL wants them; size_px and inverse_size come from the inputs.
    `before` is what the output holds beforehand, for a pass that works in place.
    Returns (h, w, c).
    """
    height, width = next(iter(inputs.values())).shape[:2]
    block = np.zeros((), FRAME)
    for field, value in {"size_px": (width, height), "inverse_size": (1 / width, 1 / height), **frame}.items():
        block[field] = value
    program = ctx.compute_shader(assemble(shader, load_glsl(), defines).text)
    uniforms = ctx.buffer(block.tobytes())
    uniforms.bind_to_uniform_block(0)
    textures = []
    for unit, (name, array) in enumerate(inputs.items()):
        texture = ctx.texture(
            (width, height),
            array.shape[2],
            np.ascontiguousarray(array).tobytes(),
            alignment=1,
            dtype=_DTYPE[array.dtype.name],
        )
        texture.repeat_x = texture.repeat_y = False
        texture.use(unit)
        if name in program:
            program[name] = unit
        textures.append(texture)
    name, dtype, components = output
    texels = None if before is None else np.ascontiguousarray(before, dtype).tobytes()
    result = ctx.texture((width, height), components, texels, alignment=1, dtype=_DTYPE[dtype])
    result.bind_to_image(0, read=before is not None, write=True)
    program[name] = 0
    program.run(-(-width // 8), -(-height // 8))
    ctx.memory_barrier()
    values = np.frombuffer(result.read(alignment=1), dtype).reshape(height, width, components).copy()
    for resource in (program, uniforms, result, *textures):
        resource.release()
    return values
