"""Programs: every pass compiles in every permutation a scene can ask for, names match both ways, reloading is safe."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from app.bvh.build import build_bvh
from app.bvh.top import scene_tree
from app.camera import look_at
from app.errors import UserError
from app.frame.pipeline import VIEWS, frame_plan
from app.frame.records import Call, Pass
from app.frame.targets import TARGETS
from app.gpu.execute import program_key
from app.gpu.programs import Programs, _sources, check_names
from app.gpu.scene import GpuScene
from app.gpu.shaders import ShaderError
from app.renderer import Renderer
from app.scene.facts import Facts
from app.scene.flatten import flatten
from app.scene.model import Light, Material, TextureSlot
from app.settings import Settings, from_dict, put, walk

from .guarantees import check_granted
from .small_scenes import checker, moving, quad, scene_of

NOTHING = Facts(near_coc_px=30.0, far_coc_px=30.0)
FLAGS = [f.name for f in fields(Facts) if f.type == "bool"]
EVERYTHING = replace(NOTHING, lights=2, **dict.fromkeys(FLAGS, True))
VIEWABLE = [*VIEWS, *(t for t in TARGETS if t not in VIEWS and t not in ("display", "resolved"))]
CAMERA = look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
SIZE = (49, 35)  # odd, so that half resolution and the last work group are incomplete


@pytest.fixture(scope="module")
def scene(ctx: moderngl.Context) -> Iterator[GpuScene]:
    made = rich_scene(ctx)
    yield made
    made.release()


def rich_scene(ctx: moderngl.Context, textures: bool | None = None) -> GpuScene:
    """A quad in front of focus and one behind, with every feature that a material and a light can have."""
    slot = TextureSlot(0)
    rich = Material(
        base_color_texture=slot, metallic_roughness_texture=slot, normal_texture=slot, emissive_texture=slot,
        emissive=(1.0, 1.0, 1.0), alpha_cutoff=0.5,
    )  # fmt: skip
    quads = [quad((-0.6, -0.6, 1.5), (1.2, 0, 0), (0, 1.2, 0)), quad((-4, -4, -3), (8, 0, 0), (0, 8, 0), material=1)]
    quads.append(quad((0.5, -0.5, 0), (0.5, 0, 0), (0, 0.5, 0), material=1))
    lights = [
        Light("sun", (1, 1, 1), 3.0, direction=(0.0, -0.6, -0.8)),
        Light("point", (1, 1, 1), 5.0, position=(0, 2, 0)),
    ]
    made = scene_of(quads, [rich, Material()], [checker(8, 40, 220, alpha=True)], lights)
    made = moving(made, 2, slide=[(0, 0, 0), (-1, 0, 0)])
    triangles = flatten(made)
    gpu_scene = GpuScene(
        ctx, made, triangles, lambda progress=None: scene_tree(triangles, build_bvh, progress), textures
    )
    gpu_scene.ensure_bvh()
    return gpu_scene


def permutations() -> Iterator[tuple[Settings, Facts]]:
    """Default and full scenes under default settings, then each fact and each compiled setting changed on its own."""
    yield Settings(), EVERYTHING
    yield Settings(), NOTHING
    for flag in FLAGS:
        # a normal map is a texture, and what is in view is in the scene
        also = {"textured": ("normal_mapped", "normal_mapped_in_view"), "normal_mapped": ("normal_mapped_in_view",)}
        off = (flag, *also.get(flag, ()))
        yield Settings(), replace(EVERYTHING, **dict.fromkeys(off, False))
    yield Settings(), replace(EVERYTHING, lights=1)
    for path, leaf, value in walk(Settings()):
        if isinstance(value, bool) and leaf.metadata["static"]:
            yield put(Settings(), path, not value), EVERYTHING
    for change in (
        {"lens.blades": 5}, {"post.rings": 2}, {"post.rings": 8}, {"shading.mode": "unlit"}, {"shading.tone_map":
        "aces"}, {"shading.tone_map": "neutral"}, {"overlay.focus_plane": True}, {"shading.mode": "unlit",
        "lens.blades": 6},
    ):  # fmt: skip
        yield from_dict(change), EVERYTHING


def every_call() -> dict[tuple[object, ...], Call]:
    """Each different permutation of each pass that any view or target can plan."""
    calls = {}
    for settings, facts in permutations():
        for view in VIEWABLE:
            try:
                plan = frame_plan(view, settings, facts)
            except UserError:
                continue  # a target that such a scene has not
            calls |= {(c.program, c.reads): c for c in plan.parts}
    return calls


CALLS = every_call()
NAMES = list(dict.fromkeys(call.step.name for call in CALLS.values()))


@pytest.mark.parametrize("name", NAMES)
def test_every_permutation_compiles_and_its_names_match_both_ways(
    ctx: moderngl.Context, scene: GpuScene, name: str
) -> None:
    programs = Programs(ctx)
    for call in (c for c in CALLS.values() if c.step.name == name):
        compiled = programs.get(*program_key(programs, call, scene))
        check_names(call, compiled)
        check_granted(call, compiled)
    programs.release()


def test_no_pass_takes_more_than_every_driver_grants(ctx: moderngl.Context) -> None:
    """With the records in storage blocks, as GPUs have them; the test above has them where this device wants them."""
    scene, programs = rich_scene(ctx, textures=False), Programs(ctx)
    for call in {c.program: c for view in VIEWABLE for c in frame_plan(view, Settings(), EVERYTHING).parts}.values():
        check_granted(call, programs.get(*program_key(programs, call, scene)))
    programs.release()
    scene.release()


@pytest.mark.parametrize("name", NAMES)
def test_no_shader_branches_on_a_name_that_its_pass_never_defines(
    ctx: moderngl.Context, scene: GpuScene, name: str
) -> None:
    """An undefined name in #if counts as 0 without a word: a typo would compile."""
    import re

    for call in (c for c in CALLS.values() if c.step.name == name):
        _, asked_for, _ = call.program
        defines = dict((*asked_for, *scene.defines.items()) if call.step.scene else asked_for)
        programs = Programs(ctx)
        sources = _sources((call.step.shader, tuple(defines.items()), ()), programs._files)
        programs.release()
        for source in sources:
            code = re.sub(r"//[^\n]*", "", source.text)
            known = set(re.findall(r"^\s*#define\s+(\w+)", code, re.MULTILINE)) | {"defined"}
            asked = {
                w
                for line in re.findall(r"^\s*#(?:if|elif)\s+(.*)$", code, re.MULTILINE)
                for w in re.findall(r"[A-Za-z_]\w*", line)
            }
            guarded = set(re.findall(r"^\s*#(?:ifdef|ifndef)\s+(\w+)", code, re.MULTILINE))
            assert asked <= known | guarded, f"{call.step.shader}: {sorted(asked - known - guarded)}"
        break  # one permutation names every define that the others have


@pytest.mark.parametrize("view", VIEWABLE)
def test_every_view_and_target_draws_without_a_gl_error(ctx: moderngl.Context, scene: GpuScene, view: str) -> None:
    settings = from_dict({"lens.aperture": 1.0, "lens.focus_distance": 3.0})
    renderer = Renderer(ctx, scene, SIZE)
    for frame in range(2):  # the second has a history, and a camera and an object that moved
        renderer.draw(view, CAMERA.moved(0.01 * frame, 0.0, 0.0), settings, time_s=0.1 * frame)
    picture = renderer.picture()
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert np.isfinite(renderer.linear()).all()
    assert ctx.error == "GL_NO_ERROR"
    renderer.release()


# -- names, on shaders made up for the purpose -------------------------------------------------------------------------

HEAD = "// purpose\nlayout(local_size_x = 8, local_size_y = 8) in;\nuniform sampler2D in_lit;\n"
IMAGE = "layout(rgba16f) uniform writeonly image2D out_post;\n"
MAIN = "void main() { imageStore(out_post, ivec2(0), texelFetch(in_lit, ivec2(0), 0)); }\n"
GOOD = HEAD + IMAGE + MAIN


def compiled(ctx: moderngl.Context, folder: Path, text: str) -> tuple[Programs, object]:
    (folder / "x.comp").write_text(text)
    programs = Programs(ctx, folder)
    return programs, programs.get("x.comp", ())


def call(reads: tuple[str, ...], writes: tuple[str, ...]) -> Call:
    return Call(Pass("mine", "x.comp", reads=reads, writes=writes), tuple((r, r) for r in reads), writes, (), "")


@pytest.mark.parametrize(
    ("reads", "writes", "message"),
    [
        (("coc",), ("post",), r"pass mine: x\.comp uses \['in_lit'\], which the pass does not declare"),
        (("lit",), ("hybrid",), r"pass mine: x\.comp uses \['out_post'\]"),
        (("lit", "coc"), ("post",), r"pass mine declares \['in_coc'\], which x\.comp never mentions"),
        (("lit",), ("post", "coc"), r"pass mine declares \['out_coc'\]"),
    ],
)
def test_a_typo_on_either_side_names_the_pass(
    ctx: moderngl.Context, tmp_path: Path, reads: tuple[str, ...], writes: tuple[str, ...], message: str
) -> None:
    programs, program = compiled(ctx, tmp_path, GOOD)
    with pytest.raises(ShaderError, match=message):
        check_names(call(reads, writes), program)  # type: ignore[arg-type]
    check_names(call(("lit",), ("post",)), program)  # type: ignore[arg-type]
    programs.release()


BLOCK = "layout(std430) readonly buffer RayTiles { uvec4 work[2]; };\n"
READS_BLOCK = HEAD + IMAGE + BLOCK + "void main() { imageStore(out_post, ivec2(0), vec4(work[0])); }\n"


@pytest.mark.parametrize(
    ("text", "blocks", "message"),
    [
        (READS_BLOCK, {}, r"pass mine: x\.comp uses \['RayTiles'\], which the pass does not declare"),
        (READS_BLOCK, {"over": "EdgeTiles"}, r"pass mine: x\.comp uses \['RayTiles'\]"),
        (READS_BLOCK.replace("RayTiles", "Misspelt"), {"buffers": ("RayTiles",)}, r"uses \['Misspelt'\]"),
        (READS_BLOCK, {"over": "RayTiles", "fills": ("MaskReach",)}, r"pass mine declares \['MaskReach'\]"),
    ],
)
def test_a_block_that_either_side_does_not_know_names_the_pass(
    ctx: moderngl.Context, tmp_path: Path, text: str, blocks: dict[str, Any], message: str
) -> None:
    """Bound to nothing, it would read whatever lies at the first binding."""
    programs, program = compiled(ctx, tmp_path, text)
    step = Pass("mine", "x.comp", reads=("lit",), writes=("post",), **blocks)
    with pytest.raises(ShaderError, match=message):
        check_names(Call(step, (("lit", "lit"),), ("post",), (), ""), program)  # type: ignore[arg-type]
    programs.release()


@pytest.mark.parametrize("blocks", [{"over": "RayTiles"}, {"buffers": ("RayTiles",)}, {"fills": ("RayTiles",)}])
def test_a_block_may_be_read_filled_or_run_over(ctx: moderngl.Context, tmp_path: Path, blocks: dict[str, Any]) -> None:
    programs, program = compiled(ctx, tmp_path, READS_BLOCK)
    step = Pass("mine", "x.comp", reads=("lit",), writes=("post",), **blocks)
    check_names(Call(step, (("lit", "lit"),), ("post",), (), ""), program)  # type: ignore[arg-type]
    programs.release()


def test_a_comment_does_not_count_as_use(ctx: moderngl.Context, tmp_path: Path) -> None:
    programs, program = compiled(ctx, tmp_path, "// in_coc here\n/* in_coc\n there */" + GOOD)
    with pytest.raises(ShaderError, match="in_coc"):
        check_names(call(("lit", "coc"), ("post",)), program)  # type: ignore[arg-type]
    programs.release()


def test_an_input_that_the_compiler_drops_is_no_error(ctx: moderngl.Context, tmp_path: Path) -> None:
    text = (
        HEAD
        + "uniform sampler2D in_coc;\n"
        + IMAGE
        + MAIN.replace("{ ", "{ float unused = texelFetch(in_coc, ivec2(0), 0).r; ")
    )
    programs, program = compiled(ctx, tmp_path, text)
    check_names(call(("lit", "coc"), ("post",)), program)  # type: ignore[arg-type]
    programs.release()


def test_a_stale_frame_block_is_refused(ctx: moderngl.Context, tmp_path: Path) -> None:
    block = "layout(std140) uniform FrameBlock { vec4 only; };\n"
    with pytest.raises(ShaderError, match="FrameBlock has 16 bytes"):
        compiled(ctx, tmp_path, HEAD + IMAGE + block + MAIN.replace("texelFetch(in_lit, ivec2(0), 0)", "only"))


# -- hot reload --------------------------------------------------------------------------------------------------------


def test_reloading_swaps_what_changed_and_keeps_the_last_good_program(ctx: moderngl.Context, tmp_path: Path) -> None:
    (tmp_path / "other.comp").write_text(GOOD)
    programs, first = compiled(ctx, tmp_path, GOOD)
    other = programs.get("other.comp", ())
    assert programs.reload() is None
    assert programs.get("x.comp", ()) is first, "nothing changed, nothing is compiled"

    (tmp_path / "x.comp").write_text(GOOD.replace("void main", "oops main"))
    error = programs.reload()
    assert error is not None
    assert "x.comp:5" in error
    assert programs.get("x.comp", ()) is first

    (tmp_path / "x.comp").unlink()
    assert "x.comp" in (programs.reload() or "")
    assert programs.get("x.comp", ()) is first

    (tmp_path / "x.comp").write_text(GOOD.replace("ivec2(0), 0)", "ivec2(1), 0)"))
    assert programs.reload() is None
    assert programs.get("x.comp", ()) is not first
    assert programs.get("other.comp", ()) is other
    programs.release()
    assert len(programs) == 0


MENTIONS = "#if A > 1 && defined(B)\n#endif\n"


def test_permutations_are_compiled_once(ctx: moderngl.Context, tmp_path: Path) -> None:
    programs, first = compiled(ctx, tmp_path, GOOD + MENTIONS)
    assert programs.get("x.comp", ()) is first
    one = programs.get("x.comp", (("A", 1), ("B", 2)))
    assert programs.get("x.comp", (("B", 2), ("A", 1))) is one
    assert len(programs) == programs.builds == 2
    programs.release()


def test_a_define_that_no_file_mentions_makes_no_program(ctx: moderngl.Context, tmp_path: Path) -> None:
    (tmp_path / "part.glsl").write_text("#if B\n#endif\n")
    programs, first = compiled(ctx, tmp_path, '#include "part.glsl"\n' + GOOD)
    assert programs.get("x.comp", (("A", 1),)) is first
    assert programs.get("x.comp", (("A", 1), ("B", 1))) is not first, "an included file mentions it"
    assert programs.builds == 2
    programs.release()


def test_permutations_of_a_file_that_went_away_stay_apart(ctx: moderngl.Context, tmp_path: Path) -> None:
    programs, first = compiled(ctx, tmp_path, GOOD + MENTIONS)
    one = programs.get("x.comp", (("A", 1),))
    (tmp_path / "x.comp").unlink()
    assert programs.reload()
    assert programs.get("x.comp", (("A", 1),)) is one
    assert programs.get("x.comp", ()) is first
    programs.release()


def test_the_least_recently_used_program_gives_way_and_is_released(ctx: moderngl.Context, tmp_path: Path) -> None:
    (tmp_path / "x.comp").write_text(GOOD + MENTIONS)
    programs = Programs(ctx, tmp_path, most=3)
    made = [programs.get("x.comp", (("A", k),)) for k in range(3)]
    programs.get("x.comp", (("A", 0),))
    assert not programs.has_run(programs.key("x.comp", (("A", 1),)), ()), "asking counts as a use"
    programs.get("x.comp", (("A", 3),))
    assert len(programs) == 3
    assert [isinstance(m.program.mglo, moderngl.InvalidObject) for m in made] == [False, False, True]
    assert programs.get("x.comp", (("A", 0),)) is made[0]
    for k in range(20):
        programs.get("x.comp", (("A", k),))
        assert len(programs) <= 3
    assert len(programs._asked) <= 3, "nor do the names add up"
    programs.release()
