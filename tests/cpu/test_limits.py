"""What a frame asks of a driver, against what every OpenGL 4.3 driver grants (core specification 4.3, tables 23.58 to
23.75): dispatches, blocks, attachments. Programs are in tests/gpu/test_programs.py.
"""

from __future__ import annotations

import math
import re

import pytest

from app.frame.memory import texels
from app.frame.pipeline import PASSES
from app.frame.targets import TARGETS
from app.gpu.error_sums import BLOCK
from app.gpu.error_sums import GROUP as ERROR_GROUP
from app.gpu.health import GROUP as HEALTH_GROUP
from app.gpu.layout import FRAME
from app.gpu.shaders import load_glsl
from app.measure.regions import REGIONS

GROUPS = 65535  # along one dimension
INVOCATIONS = 1024  # of a work group
SHARED = 32768  # bytes of a work group
UNIFORM_BLOCK = 16384  # bytes
SIDE = 32768  # px: the largest texture of today's devices, twice what is granted
BYTES = {"uint": 4, "int": 4, "float": 4, "vec2": 8, "vec3": 16, "vec4": 16, "uvec2": 8, "ivec2": 8, "uvec4": 16}


@pytest.mark.parametrize("name", [p.name for p in PASSES if p.kind == "compute" and not p.over])
def test_no_picture_needs_more_work_groups_than_are_granted(name: str) -> None:
    """Indirect dispatches fold their groups into rows: tests/gpu/test_work_list.py."""
    step = next(p for p in PASSES if p.name == name)
    grid = texels(TARGETS[step.grid or next(iter((*step.writes, *step.updates)))], (SIDE, SIDE))
    assert max(math.ceil(side / group) for side, group in zip(grid, step.group, strict=True)) <= GROUPS


def test_nor_do_the_measures() -> None:
    assert SIDE / HEALTH_GROUP <= GROUPS
    assert SIDE / ERROR_GROUP <= GROUPS
    assert SIDE / BLOCK * len(REGIONS) <= SIDE, "the sums' own texture has a row for each row of blocks and region"


@pytest.mark.parametrize("name", [name for name in load_glsl() if name.endswith(".comp")])
def test_work_groups_and_what_they_share_are_as_large_as_is_granted(name: str) -> None:
    files = load_glsl()
    text = re.sub(r"//[^\n]*", "", files[name])
    layout = re.search(r"layout\((local_size[^)]*)\) in", text)
    assert layout
    assert math.prod(int(n) for n in re.findall(r"= (\d+)", layout[1])) <= INVOCATIONS
    shared = 0
    for kind, names in re.findall(r"^shared (\w+) ([^;]+);", text, re.MULTILINE):
        for entry in names.split(","):
            size = re.search(r"\[([^\]]+)\]", entry)
            shared += BYTES[kind] * (_value(size[1], text) if size else 1)
    assert shared <= SHARED


def _value(expression: str, text: str) -> int:
    constants = dict(re.findall(r"const u?int (\w+) = ([^;]+);", text))
    while names := re.findall(r"[A-Za-z_]\w*", expression):
        for name in names:
            expression = re.sub(rf"\b{name}\b", f"({constants[name]})", expression)
    return int(eval(re.sub(r"(\d)u", r"\1", expression)))


def test_the_frames_block_fits_and_needs_no_alignment() -> None:
    """It is bound whole, from its first byte: GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT concerns parts of buffers."""
    assert FRAME.itemsize <= UNIFORM_BLOCK
    assert FRAME.itemsize % 16 == 0, "std140: whole vec4s"


def test_a_raster_pass_writes_no_more_than_eight_targets() -> None:
    assert max(len((*p.writes, *(t for t, _ in p.writes_if))) for p in PASSES if p.kind == "raster") <= 8
