"""Shaders edited while the window runs: whatever is wrong with a file, the last good program goes on, and says so."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.camera import Camera
from app.data import data_dir
from app.gpu import shaders
from app.gpu.programs import Programs
from app.gpu.timing import RING
from app.measure.live import LiveError
from app.measure.reference import Reference
from app.panel.model import Look
from app.renderer import Renderer
from app.settings import Settings, ToneMap, put
from app.window.stage import Stage

from .live_objects import live_objects

SIZE = (32, 18)
LOOK = Look(view="post")
SHOWN = "output/display.comp"  # the last pass of every view
COC = "lib/coc.glsl"  # which many include


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A copy of the shaders that the program reads from. Whoever edits it repairs it."""
    copy = tmp_path_factory.mktemp("shaders") / "glsl"
    shutil.copytree(data_dir("glsl"), copy)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shaders, "data_dir", lambda kind: copy.parent / kind)
        yield copy


@pytest.fixture(scope="module")
def stage(ctx: moderngl.Context, folder: Path) -> Iterator[Stage]:
    made = Stage(ctx, lambda text, fraction: None)
    made.load("stress:hedge")  # whose shadows are seen
    for _ in range(2 * RING):  # buffers of what is read late
        picture(made)
    yield made
    made.release()


def picture(stage: Stage, look: Look = LOOK) -> np.ndarray:
    stage.draw(look, camera(stage), SIZE)
    return stage.picture(look)


def camera(stage: Stage) -> Camera:
    return stage.viewpoints[0].camera


def append(text: str) -> Callable[[Path], object]:
    return lambda file: file.write_text(file.read_text() + text)


def insert(text: str) -> Callable[[Path], object]:
    """Before the code's first line, where includes stand."""
    return lambda file: file.write_text(text + file.read_text())


def swap(old: str, new: str) -> Callable[[Path], object]:
    def edit(file: Path) -> None:
        assert old in file.read_text()
        file.write_text(file.read_text().replace(old, new))

    return edit


MAIN = "void main() {"
FAULTS: dict[str, tuple[str, Callable[[Path], object], str]] = {  # the file, what happens to it, what is told
    "a syntax error": (SHOWN, append("\nthis is no GLSL\n"), f"{SHOWN}:{{end}}:"),
    "a syntax error in what many include": (COC, append("\nthis is no GLSL\n"), f"{COC}:{{end}}:"),
    "an unknown name": (SHOWN, swap(MAIN, MAIN + " nowhere = 1.0;"), "nowhere"),
    "garbage": (SHOWN, lambda file: file.write_bytes(bytes(range(1, 128)) * 20), SHOWN),
    "no text": (SHOWN, lambda file: file.write_bytes(file.read_bytes() + b"\n\n// \xff\xfe\n"), f"{SHOWN}:{{end}}"),
    "a NUL": (SHOWN, lambda file: file.write_bytes(file.read_bytes() + b"\n// \0\n"), SHOWN),
    "nothing in it": (SHOWN, lambda file: file.write_bytes(b""), SHOWN),
    "the file is gone": (SHOWN, lambda file: file.unlink(), SHOWN),
    "an include is gone": (COC, lambda file: file.unlink(), COC),
    "a folder in its place": (SHOWN, lambda file: (file.unlink(), file.mkdir()), SHOWN),
    "a missing include": (SHOWN, insert('#include "lib/nowhere.glsl"\n'), f"{SHOWN}:1:"),
    "an include of itself": (SHOWN, insert(f'#include "{SHOWN}"\n'), "include cycle"),
    "it compiles but does not link": (
        SHOWN,
        swap(MAIN, "float missing(float x);\n" + MAIN + " if (missing(1.0) > 0.0) return;"),
        "missing",
    ),
    "no main": (SHOWN, swap(MAIN, "void other() {"), SHOWN),
    "it compiles but names another target": (SHOWN, swap("in_color", "in_colour"), "in_colour"),
    "it compiles but another frame block": (
        "shared/structs.glsl",
        swap("float near_plane;", "float near_plane; vec4 surplus[3];"),
        "FrameBlock",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_the_last_good_program_goes_on_until_the_file_is_repaired(
    ctx: moderngl.Context, stage: Stage, folder: Path, fault: str
) -> None:
    name, harm, told = FAULTS[fault]
    assert stage.reload_shaders() == ""
    before = picture(stage)
    objects = live_objects(ctx)
    whole = (folder / name).read_bytes()
    harm(folder / name)
    end = whole.count(b"\n") + 2 + (fault == "no text")
    error = stage.reload_shaders()
    assert told.format(end=end) in error
    np.testing.assert_array_equal(picture(stage), before)
    other = replace(LOOK, settings=put(Settings(), "shading.tone_map", ToneMap.ACES))
    assert (picture(stage, other) != before).any(), "a permutation that was not compiled yet: of the text before"
    assert stage.reload_shaders() != "", "it is told for as long as it is so"
    if (folder / name).is_dir():
        (folder / name).rmdir()
    (folder / name).write_bytes(whole)
    assert stage.reload_shaders() == ""
    np.testing.assert_array_equal(picture(stage), before)
    more = live_objects(ctx) - objects
    # moderngl leaves an empty program behind where one does not compile: two reloads, and the other tone map's own
    assert set(more) <= {"Program"}
    assert more["Program"] <= 3


def test_reloading_reaches_what_stands_outside_the_frames_plan(
    ctx: moderngl.Context, stage: Stage, folder: Path
) -> None:
    """The shadow map, the count of bad texels, the map of the error."""
    look = Look(view="lit")
    stage.reload_shaders()
    lit = picture(stage, look)
    side = stage.sides[0]

    def counted() -> dict[str, int]:
        side.renderer.health.watched = "all"
        side.renderer.draw("lit", camera(stage), look.settings)
        return {name: bad.non_finite for name, bad in side.renderer.health.finish().items()}

    live = LiveError(ctx, stage.rehearsal.programs)
    live.set_reference(
        Reference(np.ones((2, SIZE[1], SIZE[0], 3), np.float32), *np.zeros((2, *SIZE[::-1]), np.float32))
    )

    def painted() -> bytes:
        return bytes(live.heat_map(drawn(stage, replace(look, view="sharp"))).read())

    right = painted()
    edited = ("raster/shadow.vert", "measure/health.comp", "measure/heat.comp")
    whole = {name: (folder / name).read_text() for name in edited}
    assert counted()["lit"] == 0
    beyond = swap("sun_view_proj * vec4", "vec4(0.0, 0.0, 2.0, 1.0) + 0.0 * sun_view_proj * vec4")
    for name, edit in zip(
        edited,
        (beyond, swap("bool bad =", "bool bad = true ||"), swap("bool valid =", "bool valid = false &&")),
        strict=True,
    ):
        edit(folder / name)
    assert stage.reload_shaders() == ""
    assert (picture(stage, look).astype(int) >= lit).all(), "nothing was drawn into the map: no shadow is left"
    assert (picture(stage, look) > lit).any()
    assert counted()["lit"] == SIZE[0] * SIZE[1]
    assert painted() != right
    live.release()
    for name, text in whole.items():
        (folder / name).write_text(text)
    assert stage.reload_shaders() == ""


def drawn(stage: Stage, look: Look) -> Renderer:
    stage.draw(look, camera(stage), SIZE)
    return stage.sides[0].renderer


def test_a_sides_shadow_map_is_not_drawn_again_for_the_other(stage: Stage) -> None:
    assert stage.gpu_scene is not None
    stage.draw(Look(view="sharp"), camera(stage), SIZE)
    before = stage.gpu_scene.shadow.renders
    for _ in range(3):
        stage.draw(Look(view="sharp", other="traced", compare=True), camera(stage), SIZE)
    assert stage.gpu_scene.shadow.renders == before > 0


# -- any series of edits, on a shader made up for the purpose ----------------------------------------------------------

ONE = """#include "value.glsl"
layout(local_size_x = 1) in;
layout(r32f) uniform writeonly image2D out_one;
void main() { imageStore(out_one, ivec2(0), vec4(value() + float(PERMUTATION))); }
"""
GOOD = [f"float value() {{ return {n}.0; }}".encode() for n in range(0, 40, 10)]
BAD = [
    b"",
    b"float value() { return }",
    b"\xff",
    b"\0",
    b"float value();",
    b"vec3 value() { return vec3(1.0, 2.0); }",
    None,
]


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.sampled_from([*GOOD, *BAD]), st.integers(0, 3)), max_size=12))
def test_after_any_edits_the_last_good_text_is_what_runs(
    ctx: moderngl.Context, tmp_path: Path, edits: list[tuple[bytes | None, int]]
) -> None:
    (tmp_path / "one.comp").write_text(ONE)
    (tmp_path / "value.glsl").write_bytes(GOOD[0])
    programs, good = Programs(ctx, tmp_path, most=2), GOOD[0]
    target = ctx.texture((1, 1), 1, dtype="f4")
    target.bind_to_image(0, read=False, write=True)
    ran = -1
    for text, permutation in [(GOOD[0], 0), *edits]:
        if text is None:
            (tmp_path / "value.glsl").unlink(missing_ok=True)
        else:
            (tmp_path / "value.glsl").write_bytes(text)
        error = programs.reload()
        assert (error is None) == (text in GOOD)
        good = text if text in GOOD else good
        program = programs.get("one.comp", [("PERMUTATION", permutation)]).program
        program["out_one"] = 0
        program.run(1)
        ctx.memory_barrier()
        ran = float(np.frombuffer(target.read(), np.float32)[0])
        assert ran == 10.0 * GOOD.index(good) + permutation
        assert len(programs) <= 2
    programs.release()
    target.release()


def test_no_more_permutations_are_kept_than_allowed_and_those_in_use_stay(
    ctx: moderngl.Context, tmp_path: Path
) -> None:
    (tmp_path / "one.comp").write_text(ONE)
    (tmp_path / "value.glsl").write_bytes(GOOD[0])
    programs, objects = Programs(ctx, tmp_path, most=4), live_objects(ctx)
    first = programs.get("one.comp", [("PERMUTATION", 0)])
    for permutation in range(1, 12):
        programs.get("one.comp", [("PERMUTATION", permutation)])
        assert programs.get("one.comp", [("PERMUTATION", 0)]) is first
        assert live_objects(ctx)["Program"] - objects["Program"] == len(programs) <= 4
    programs.release()
    assert live_objects(ctx) == objects
