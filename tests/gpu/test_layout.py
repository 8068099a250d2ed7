"""Every GPU struct has one layout: the dtype's offsets are the ones the GPU reads and writes."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.data import data_dir
from app.gpu.layout import (
    FRAME,
    OBJECT,
    RECORDS,
    STRUCTS,
    STRUCTS_FILE,
    TEXELS_PER_ROW,
    VERTEX,
    struct,
    struct_fields,
    struct_name,
    structs_glsl,
)
from app.gpu.records import RecordTexture
from app.gpu.shaders import assemble, load_glsl

EACH_STRUCT = pytest.mark.parametrize("dtype", STRUCTS, ids=struct_name)
PARTS = {"2": "xy", "3": "xyz", "4": "xyzw"}
COUNT = 3  # more than one, so that the stride counts


def parts(dtype: np.dtype) -> list[tuple[str, str]]:
    """(GLSL expression after the struct, scalar type) of every scalar in a struct, in the order of numpy's ravel."""
    found = []
    for field, (kind, _) in struct_fields(dtype).items():
        scalar = {"u": "uint", "i": "int"}.get(kind[0], "float") if kind != "int" else "int"
        if kind == "mat4":
            found += [(f"{field}[{column}].{part}", "float") for column in range(4) for part in "xyzw"]
        elif kind[-1] in PARTS:
            found += [(f"{field}.{part}", scalar) for part in PARTS[kind[-1]]]
        else:
            found.append((field, scalar))
    return found


def flat(records: np.ndarray) -> np.ndarray:
    """All scalars (n, k) of records as raw bits, in the order of `parts`."""
    columns = [records[name].reshape(len(records), -1).view(np.uint32) for name in records.dtype.names]
    return np.concatenate(columns, 1)


def distinct(dtype: np.dtype, count: int) -> np.ndarray:
    """Records whose every scalar is another number."""
    records, number = np.zeros(count, dtype), 0
    for i in range(count):
        for name in dtype.names:
            size = records[name][i].size
            records[name][i] = (number + 1 + np.arange(size)).reshape(records[name][i].shape)
            number += size
    return records


def run(
    ctx: moderngl.Context, body: str, groups: int, defines: dict[str, object] | None = None, **blocks: moderngl.Buffer
) -> None:
    kernel = f'#include "shared/structs.glsl"\nlayout(local_size_x = 1) in;\n{body}'
    shader = ctx.compute_shader(assemble("<test>", {**load_glsl(), "<test>": kernel}, defines).text)
    for binding, (name, buffer) in enumerate(blocks.items()):
        shader[name].binding = binding
        if name == "Uniforms":
            buffer.bind_to_uniform_block(binding)
        else:
            buffer.bind_to_storage_buffer(binding)
    shader.run(groups)
    ctx.memory_barrier()
    shader.release()


def bits(expression: str, scalar: str) -> str:
    return {"float": f"floatBitsToUint({expression})", "int": f"uint({expression})", "uint": expression}[scalar]


@EACH_STRUCT
def test_the_gpu_reads_every_field_where_the_dtype_put_it(ctx: moderngl.Context, dtype: np.dtype) -> None:
    records, fields = distinct(dtype, COUNT), parts(dtype)
    source = ctx.buffer(records.tobytes())
    echo = ctx.buffer(reserve=4 * len(fields) * COUNT)
    stores = "\n".join(f"    echo[base + {i}u] = {bits(f'source[r].{e}', s)};" for i, (e, s) in enumerate(fields))
    body = f"""layout(std430) readonly buffer Source {{ {struct_name(dtype)} source[]; }};
layout(std430) writeonly buffer Echo {{ uint echo[]; }};
void main() {{
    uint r = gl_WorkGroupID.x, base = r * {len(fields)}u;
{stores}
}}"""
    run(ctx, body, COUNT, Source=source, Echo=echo)
    found = np.frombuffer(echo.read(), "<u4").reshape(COUNT, -1)
    assert (found == flat(records)).all()
    assert len(np.unique(found)) == found.size
    source.release()
    echo.release()


@pytest.mark.parametrize("dtype", RECORDS, ids=struct_name)
def test_a_texture_of_records_reads_as_a_block_does(ctx: moderngl.Context, dtype: np.dtype) -> None:
    """Whole records, also where one goes on in the next row of texels."""
    fields, first = parts(dtype), TEXELS_PER_ROW // (dtype.itemsize // 16) - 1
    expected = distinct(dtype, COUNT)
    source = RecordTexture(ctx, np.concatenate([np.zeros(first, dtype), expected]).tobytes())
    echo = ctx.buffer(reserve=4 * len(fields) * COUNT)
    stores = "\n".join(f"    echo[base + {i}u] = {bits(f'record.{e}', s)};" for i, (e, s) in enumerate(fields))
    body = f"""uniform usampler2D source;
layout(std430) writeonly buffer Echo {{ uint echo[]; }};
void main() {{
    uint r = gl_WorkGroupID.x, base = r * {len(fields)}u;
    {struct_name(dtype)} record;
    read_record(source, {first}u + r, record);
{stores}
}}"""
    source.texture.use(0)
    run(ctx, body, COUNT, {"RECORDS_IN_TEXTURES": 1}, Echo=echo)
    assert (np.frombuffer(echo.read(), "<u4").reshape(COUNT, -1) == flat(expected)).all()
    source.release()
    echo.release()


def test_new_records_replace_the_first_ones_and_no_more(ctx: moderngl.Context) -> None:
    row = TEXELS_PER_ROW * 16
    for count in (1, row // OBJECT.itemsize + 2):  # less than a row of texels, and more
        old, new = distinct(OBJECT, count + 5), distinct(OBJECT, count + 5)[::-1][:count]
        texture = RecordTexture(ctx, old.tobytes())
        texture.write(new.tobytes())
        assert texture.read()[: old.nbytes] == new.tobytes() + old[count:].tobytes()
        assert texture.size % row == 0
        texture.release()


@EACH_STRUCT
def test_the_gpu_writes_every_field_where_the_dtype_reads_it(ctx: moderngl.Context, dtype: np.dtype) -> None:
    expected, fields = distinct(dtype, COUNT), parts(dtype)
    values = ctx.buffer(flat(expected).tobytes())
    made = ctx.buffer(bytes(dtype.itemsize * COUNT))
    read = {"float": "uintBitsToFloat(values[{}])", "int": "int(values[{}])", "uint": "values[{}]"}
    stores = "\n".join(f"    made[r].{e} = {read[s].format(f'base + {i}u')};" for i, (e, s) in enumerate(fields))
    body = f"""layout(std430) readonly buffer Values {{ uint values[]; }};
layout(std430) writeonly buffer Made {{ {struct_name(dtype)} made[]; }};
void main() {{
    uint r = gl_WorkGroupID.x, base = r * {len(fields)}u;
{stores}
}}"""
    run(ctx, body, COUNT, Values=values, Made=made)
    assert (flat(np.frombuffer(made.read(), dtype)) == flat(expected)).all()
    values.release()
    made.release()


def test_the_frame_is_the_same_as_a_std140_uniform_block(ctx: moderngl.Context) -> None:
    record, fields = distinct(FRAME, 1), parts(FRAME)
    source, echo = ctx.buffer(record.tobytes()), ctx.buffer(reserve=4 * len(fields))
    stores = "\n".join(f"    echo[{i}] = {bits(f'frame.{e}', s)};" for i, (e, s) in enumerate(fields))
    body = f"""layout(std140) uniform Uniforms {{ Frame frame; }};
layout(std430) writeonly buffer Echo {{ uint echo[]; }};
void main() {{
{stores}
}}"""
    run(ctx, body, 1, Uniforms=source, Echo=echo)
    assert (np.frombuffer(echo.read(), "<u4") == flat(record)[0]).all()
    source.release()
    echo.release()


def test_the_committed_glsl_is_what_the_dtypes_print() -> None:
    committed = (data_dir("glsl") / STRUCTS_FILE).read_text()
    assert committed == structs_glsl(), "run python -m app.gpu.layout"


@EACH_STRUCT
def test_std140_and_std430_coincide(dtype: np.dtype) -> None:
    """Fields do not overlap, each is aligned for its type, and a vec3 is followed by a scalar in its fourth slot."""
    end = 0
    for name, (kind, _) in struct_fields(dtype).items():
        base, offset = dtype.fields[name][:2]
        assert offset >= end
        assert (
            offset
            % {"mat4": 16, "vec3": 16, "uvec3": 16, "vec4": 16, "uvec4": 16, "ivec4": 16}.get(kind, base.itemsize)
            == 0
        )
        end = offset + base.itemsize
    assert end <= dtype.itemsize
    if any(kind in ("mat4", "vec3", "vec4", "uvec4", "ivec4") for kind, _ in struct_fields(dtype).values()):
        assert dtype.itemsize % 16 == 0, "an array of them would have another stride in std140"


@EACH_STRUCT
def test_no_space_is_lost_and_every_field_says_what_it_means(dtype: np.dtype) -> None:
    used = sum(dtype.fields[name][0].itemsize for name in dtype.names)
    assert dtype.itemsize - used < 16, "a padding field would be shorter"
    assert any(meaning for _, meaning in struct_fields(dtype).values())


def test_struct_follows_the_alignment_rules_of_std430() -> None:
    dtype = struct(
        "S", {"a": ("float", ""), "b": ("vec3", ""), "c": ("float", ""), "d": ("vec2", ""), "e": ("mat4", "")}
    )
    assert [dtype.fields[n][1] for n in dtype.names] == [0, 16, 28, 32, 48]
    assert dtype.itemsize == 112
    assert struct("T", {"a": ("float", "")}, uniform=True).itemsize == 16
    assert VERTEX.itemsize == 32, "a vertex is half a cache line"
