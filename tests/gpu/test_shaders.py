"""Assembling shaders: includes once, no cycles, and every driver's message names the file and line a person wrote."""

from __future__ import annotations

from pathlib import Path

import moderngl
import pytest

from app.gpu.programs import Programs
from app.gpu.shaders import VERSION, ShaderError, assemble, explain, load_glsl

FILES = {
    "main.comp": '// purpose\n#include "a.glsl"\n#include "b.glsl"\nvoid main() {}\n',
    "a.glsl": '#include "c.glsl"\nfloat a() { return c(); }\n',
    "b.glsl": '// b\n  #include "c.glsl"  \nfloat b() { return c(); }\n',
    "c.glsl": "float c() { return 1.0; }\n",
}


def test_each_include_is_taken_once_and_before_its_user() -> None:
    lines = assemble("main.comp", FILES).text.splitlines()
    assert lines[0] == VERSION
    functions = [line.split("(")[0] for line in lines if "(" in line]
    assert functions == ["float c", "float a", "float b", "void main"]


def test_every_line_knows_where_it_came_from() -> None:
    source = assemble("main.comp", FILES, {"ZED": 3, "ALPHA": True})
    lines = source.text.splitlines()
    assert lines[:3] == [VERSION, "#define ALPHA 1", "#define ZED 3"]
    assert len(lines) == len(source.origin)
    for line, (file, number) in zip(lines, source.origin, strict=True):
        if file in FILES:
            assert FILES[file].splitlines()[number - 1] == line


def test_equal_defines_give_equal_text() -> None:
    assert assemble("c.glsl", FILES, {"A": 1, "B": 2}).text == assemble("c.glsl", FILES, {"B": 2, "A": True}).text


def test_lines_are_as_short_as_those_of_the_other_code() -> None:
    for name, text in load_glsl().items():
        if name != "shared/structs.glsl":  # printed from app/gpu/layout.py
            assert not [line for line in text.splitlines() if len(line) > 120], name


def test_a_missing_include_names_who_asked() -> None:
    with pytest.raises(ShaderError, match=r'main\.comp:2: no shader file "a\.glsl"'):
        assemble("main.comp", {k: v for k, v in FILES.items() if k != "a.glsl"})
    with pytest.raises(ShaderError, match=r"nowhere\.comp"):
        assemble("nowhere.comp", FILES)


def test_a_cycle_is_shown_from_end_to_end() -> None:
    files = FILES | {"c.glsl": '#include "a.glsl"\n'}
    with pytest.raises(ShaderError, match=r"c\.glsl:1: include cycle: main\.comp -> a\.glsl -> c\.glsl -> a\.glsl"):
        assemble("main.comp", files)
    with pytest.raises(ShaderError, match="cycle"):
        assemble("x", {"x": '#include "x"\n'})


@pytest.mark.parametrize(
    ("template", "rest"),
    [
        ("0:{n}(3): error: syntax error", " error: syntax error"),  # Mesa
        ("0({n}) : error C0000: syntax error", " error C0000: syntax error"),  # NVIDIA
        ("ERROR: 0:{n}: '' : syntax error", " '' : syntax error"),  # AMD, Intel on Windows, ANGLE
        ("WARNING: 0:{n}: unused", " unused"),
        ("0:{n}: error", " error"),
    ],
)
def test_every_drivers_lines_become_files_and_lines(template: str, rest: str) -> None:
    source = assemble("main.comp", FILES, {"A": 1})
    number = source.text.splitlines().index("float b() { return c(); }") + 1
    log = f"Compiler says\n{template.format(n=number)}\n"
    assert explain(log, source).splitlines() == ["Compiler says", f"b.glsl:3:{rest}"]


def test_what_is_no_location_is_left_as_it_is() -> None:
    source = assemble("c.glsl", FILES)
    for line in ("GLSL Compiler failed", "0:999(1): beyond the end", "error: no line", "3 errors", ""):
        assert explain(line, source) == line


def test_a_real_compile_error_names_the_real_file_and_line(ctx: moderngl.Context, tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "broken.glsl").write_text("// one\n// two\nfloat broken() { return undeclared_name; }\n")
    body = '#include "lib/broken.glsl"\nlayout(local_size_x = 1) in;\nvoid main() { broken(); }\n'
    (tmp_path / "user.comp").write_text("// purpose\n" + body)
    with pytest.raises(ShaderError, match=r"(?s)user\.comp: .*lib/broken\.glsl:3:.*undeclared_name"):
        Programs(ctx, tmp_path).get("user.comp", ())


@pytest.mark.parametrize("at_fault", ["vert", "frag"])
def test_an_error_in_either_stage_names_that_stage(ctx: moderngl.Context, tmp_path: Path, at_fault: str) -> None:
    for stage, body in (
        ("vert", "void main() { gl_Position = vec4(0.0); }"),
        ("frag", "out vec4 out_x; void main() { out_x = vec4(1.0); }"),
    ):
        (tmp_path / f"pair.{stage}").write_text(
            f"// {stage}\n" + (body.replace("vec4(", "missing(") if stage == at_fault else body)
        )
    with pytest.raises(ShaderError, match=rf"(?s)pair\.{at_fault}:2:.*missing"):
        Programs(ctx, tmp_path).get("pair", (), ("x",))
