"""`call_glsl`: run one GLSL function over arrays on the GPU and get an array back."""

from __future__ import annotations

import re

import moderngl
import numpy as np

from app.gpu.shaders import ShaderError, assemble, explain, load_glsl

#: GLSL type -> (numpy type, components)
_TYPES = {
    "bool": ("<u4", 1), "float": ("<f4", 1), "int": ("<i4", 1), "uint": ("<u4", 1),
    "vec2": ("<f4", 2), "vec3": ("<f4", 3), "vec4": ("<f4", 4),
    "ivec2": ("<i4", 2), "uvec2": ("<u4", 2), "uvec3": ("<u4", 3), "uvec4": ("<u4", 4),
}  # fmt: skip
_SCALAR = {"<f4": "float", "<i4": "int", "<u4": "uint"}
_SIGNATURE = re.compile(r"\s*(\w+)\s+(\w+)\s*\(([^)]*)\)\s*")


def call_glsl(
    ctx: moderngl.Context,
    include: str,
    signature: str,
    *args: object,
    defines: dict[str, object] | None = None,
    extra: str = "",
) -> np.ndarray:
    """Call `signature` ("float f(vec2 a, float b)") from the file `include` for every row of `args` (broadcast).

    Returns (n,) or (n, k). `extra` is GLSL placed after the include, for wrappers around functions with out parameters.
    """
    match = _SIGNATURE.fullmatch(signature)
    assert match, signature
    result, function, parameters = match[1], match[2], [p.split()[0] for p in match[3].split(",") if p.strip()]
    count = max([np.shape(a)[0] for a in args if np.ndim(a)] or [1])
    declarations, loads, buffers = [], [], []
    for i, (kind, value) in enumerate(zip(parameters, args, strict=True)):
        base, k = _TYPES[kind]
        declarations.append(f"layout(std430, binding={i + 1}) readonly buffer A{i} {{ {_SCALAR[base]} a{i}[]; }};")
        parts = ", ".join(f"a{i}[i*{k}u+{j}u]" for j in range(k))
        loads.append(f"({parts} != 0u)" if kind == "bool" else f"{kind}({parts})" if k > 1 else parts)
        array = np.asarray(value, base)
        if k > 1 and array.ndim == 1:
            array = array[None]
        array = np.broadcast_to(array, (count, k) if k > 1 else (count,))
        buffer = ctx.buffer(np.ascontiguousarray(array).tobytes())
        buffer.bind_to_storage_buffer(i + 1)
        buffers.append(buffer)
    base, k = _TYPES[result]
    store = " ".join(
        f"r[i*{k}u+{j}u] = {'uint(v)' if result == 'bool' else f'v[{j}]' if k > 1 else 'v'};" for j in range(k)
    )
    kernel = f"""#include "{include}"
{extra}
layout(local_size_x = 64) in;
{chr(10).join(declarations)}
layout(std430, binding=0) writeonly buffer R {{ {_SCALAR[base]} r[]; }};
uniform uint count;
void main() {{
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    {result} v = {function}({", ".join(loads)});
    {store}
}}"""
    source = assemble("<harness>", {**load_glsl(), "<harness>": kernel}, defines)
    try:
        shader = ctx.compute_shader(source.text)
    except moderngl.Error as error:
        raise ShaderError(explain(str(error), source)) from None
    out = ctx.buffer(reserve=count * k * 4)
    out.bind_to_storage_buffer(0)
    shader["count"] = count
    shader.run(-(-count // 64))
    ctx.memory_barrier()
    values = np.frombuffer(out.read(), base)
    for resource in (*buffers, out, shader):
        resource.release()
    return values.reshape(count, k) if k > 1 else values
