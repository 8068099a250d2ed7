"""The real pipeline under every view, target, fact and setting: valid plans, honest reasons, nothing run in vain,
nothing left over.
"""

from __future__ import annotations

import re
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import settings as effort
from hypothesis import strategies as st

from app.data import data_dir
from app.errors import UserError
from app.frame.output import SHOW_KINDS, display_pass, resolve_pass, show_pass
from app.frame.pipeline import (
    CONVERGING,
    OF_MOTION,
    PASSES,
    VIEWS,
    check_view,
    color_target,
    frame_plan,
    linear_target,
)
from app.frame.records import FramePlan, Pass, Permutation, split_read
from app.frame.targets import BUFFERS, TARGETS
from app.gpu.purpose import purpose
from app.gpu.shaders import SUFFIXES, assemble, load_glsl
from app.optics import IN_FOCUS_COC_PX
from app.scene.facts import Facts
from app.settings import Settings, from_dict, put, walk

EVERYTHING = Facts(
    near_coc_px=20.0, far_coc_px=20.0, textured=True, normal_mapped=True, emissive=True, alpha_masked=True,
    normal_mapped_in_view=True, alpha_masked_in_view=True, lights=2, sun=True, objects=True,
    camera_moved=True, objects_moved=True,
)  # fmt: skip
# compiled in as well, for speed
BRANCHES = ("lens.blades", "lens.cat_eye", "lens.spherical_aberration", "overlay.focus_plane")
COMPILED = {p: v for p, leaf, v in walk(Settings()) if leaf.metadata["static"] or p in BRANCHES}
ENUMS = ("shading.mode", "shading.tone_map")
SHOWN = sorted(set(TARGETS) - {"display", "resolved"})
FINAL = (resolve_pass("lit"), display_pass("lit", Settings(), EVERYTHING), show_pass(TARGETS["lit"]))
ALL_PASSES: tuple[Pass, ...] = (*PASSES, *FINAL)
LIMIT_IMAGES = 8  # image units that OpenGL 4.3 guarantees
LIMIT_SAMPLERS = 16  # texture units per stage that it guarantees, scene textures included
SCENE_SAMPLERS = 7

flags = {f.name: st.booleans() for f in fields(Facts) if f.type == "bool"}
facts = st.builds(Facts, st.floats(0, 500), st.floats(0, 500), lights=st.integers(0, 4), **flags)


def others(path: str, default: object) -> list[object]:
    """Values of a compiled-in setting that may change the plan."""
    if isinstance(default, bool):
        return [not default]
    if path in ENUMS:
        return list(type(default))  # type: ignore[call-overload, no-any-return]
    return [1.0] if isinstance(default, float) else [3, 8]


@st.composite
def planning_settings(draw: st.DrawFn) -> Settings:
    """Values of the settings that planning looks at: those compiled in, and the aperture."""
    choices = {p: others(p, v) for p, v in COMPILED.items()}
    settings = put(Settings(), "lens.aperture", draw(st.sampled_from([0.0, 0.05])))
    for path, values in choices.items():
        settings = put(settings, path, draw(st.sampled_from([COMPILED[path], *values])))
    return settings


def names(frame: FramePlan) -> list[str]:
    return [call.step.name for call in frame.calls]


def programs(frame: FramePlan) -> list[Permutation]:
    """What is compiled and run, in order: frames that agree in it cost the same."""
    return [part.program for part in frame.parts]


def assert_sound(frame: FramePlan) -> None:
    """Everything is written before it is read, and everything that runs is used."""
    written: set[str] = set()
    for call in frame.calls:
        assert {target for _, target in call.reads} | set(call.step.takes) <= written
        written |= {*call.writes, *call.step.fills}
        assert set(call.writes) <= TARGETS.keys()
        assert call.reason
    # beside the picture: what another pass reads in the next frame
    used = {frame.output, *(t for c in frame.calls for t in c.step.history if t not in c.writes)}
    for call in reversed(frame.calls):
        produced = {*call.writes, *call.step.fills}
        assert produced & used, f"{call.step.name} runs for nothing"
        used |= {t for _, t in call.reads} | {*call.step.takes, *call.step.history}
    assert frame.calls[-1].writes == ("display",)
    ran = names(frame)
    assert len(set(ran)) == len(ran)
    assert {p.name for p in PASSES} <= set(ran) | {s.name for s in frame.skipped}
    assert not set(ran) & {s.name for s in frame.skipped}
    assert all(s.reason and "\n" not in s.reason for s in frame.skipped)


def test_rays_everywhere_need_no_edges() -> None:
    everywhere = frame_plan("hybrid", put(Settings(), "mask.edges", False), EVERYTHING)
    names = {call.step.name for call in everywhere.calls}
    assert "trace" in names
    assert {name for name in names if name.startswith(("mask", "reach", "scout"))} == {"mask"}


@pytest.mark.parametrize("view", VIEWS)
@effort(max_examples=30)
@given(settings=planning_settings(), facts=facts)
def test_every_view_has_a_sound_plan_whatever_the_scene_and_settings(
    view: str, settings: Settings, facts: Facts
) -> None:
    frame = frame_plan(view, settings, facts)
    assert_sound(frame)
    assert linear_target(frame) in TARGETS


@given(target=st.sampled_from(sorted(set(SHOWN) - VIEWS.keys())), settings=planning_settings(), facts=facts)
def test_every_target_can_be_looked_at_or_says_why_not(target: str, settings: Settings, facts: Facts) -> None:
    written = {t for p in PASSES if p.needed(settings, facts).runs for t in (*p.outputs(settings, facts), *p.offers)}
    moving = {t for p in PASSES if p.needed(settings, replace(facts, camera_moved=True)).runs for t in p.writes}
    if target in written | (moving & set(OF_MOTION)):  # drawn for whoever looks at it
        frame = frame_plan(target, settings, facts)
        assert_sound(frame)
        assert linear_target(frame) == target
    else:
        with pytest.raises(UserError, match=rf"^nothing writes the target '{target}' here: [^\n]{{10,}}$"):
            frame_plan(target, settings, facts)


@pytest.mark.parametrize("target", SHOWN)
def test_every_target_can_be_looked_at_when_the_scene_has_everything(target: str) -> None:
    assert_sound(frame_plan(target, Settings(), EVERYTHING))


@pytest.mark.parametrize("view", ["", "nonsense", "display", "resolved", "Hybrid", "lit "])
def test_an_unknown_view_names_those_there_are(view: str) -> None:
    with pytest.raises(UserError, match=re.escape(f"--view {view}: ")) as caught:
        frame_plan(view, Settings(), EVERYTHING)
    assert all(name in str(caught.value) for name in (*VIEWS, "mask", "coc"))
    assert "\n" not in str(caught.value)


# -- only what the scene calls for -------------------------------------------------------------------------------------


@given(facts=facts)
def test_a_pinhole_runs_no_blur_and_no_rays(facts: Facts) -> None:
    settings = put(Settings(), "lens.aperture", 0.0)
    sharp = programs(frame_plan("sharp", settings, facts))
    for view in ("post", "hybrid"):
        assert programs(frame_plan(view, settings, facts)) == sharp


@given(facts=facts)
def test_nothing_in_front_of_focus_means_no_rays(facts: Facts) -> None:
    facts = replace(facts, near_coc_px=IN_FOCUS_COC_PX)
    frame = frame_plan("hybrid", Settings(), facts)
    assert programs(frame) == programs(frame_plan("post", Settings(), facts))
    reasons = {s.name: s.reason for s in frame.skipped}
    assert "focus zone" in reasons["trace"]


@given(facts=facts)
def test_everything_within_the_focus_zone_means_no_blur(facts: Facts) -> None:
    facts = replace(facts, near_coc_px=IN_FOCUS_COC_PX, far_coc_px=IN_FOCUS_COC_PX)
    assert programs(frame_plan("hybrid", Settings(), facts)) == programs(frame_plan("sharp", Settings(), facts))


def test_a_hybrid_with_something_near_traces() -> None:
    assert color_target("hybrid", Settings(), EVERYTHING) == "hybrid"
    assert {"trace", "composite", "post"} <= set(names(frame_plan("hybrid", Settings(), EVERYTHING)))


@pytest.mark.parametrize("view", VIEWS)
def test_only_traced_views_touch_the_tree(view: str) -> None:
    rays = any(call.step.rays for call in frame_plan(view, Settings(), EVERYTHING).calls)
    assert rays == (view in ("hybrid", "traced"))


@pytest.mark.parametrize("view", VIEWS)
def test_running_means_need_no_temporal_antialiasing(view: str) -> None:
    assert ("resolve" in names(frame_plan(view, Settings(), EVERYTHING))) == (view not in CONVERGING)
    off = put(Settings(), "temporal.antialias", False)
    assert "resolve" not in names(frame_plan(view, off, EVERYTHING))


def test_the_traced_view_rasterises_only_for_its_first_sample() -> None:
    assert names(frame_plan("traced", Settings(), EVERYTHING)) == ["traced", "display"]
    assert "gbuffer" in names(frame_plan("traced", Settings(), replace(EVERYTHING, unsampled=True)))


def test_the_views_that_must_agree_shade_with_one_permutation() -> None:
    """Raster and rays differ in depth of field only: every shading define of one is the other's."""

    def shading(view: str, step: str) -> dict[str, int]:
        return {c.step.name: dict(c.defines) for c in frame_plan(view, Settings(), EVERYTHING).calls}[step]

    raster, traced, hybrid = shading("sharp", "lighting"), shading("traced", "traced"), shading("hybrid", "trace")
    shared = raster.keys() & traced.keys()
    assert {"LIT", "TEXTURED", "SHADOWS"} <= shared
    assert {k: raster[k] for k in shared} == {k: traced[k] for k in shared} == {k: hybrid[k] for k in shared}


def test_static_settings_reach_a_define_and_others_do_not() -> None:
    """What `static` promises: changing such a leaf compiles another permutation or plans other passes, and no other
    leaf does.
    """
    facts = replace(EVERYTHING, unsampled=True)

    def permutations(settings: Settings) -> list[list[tuple[object, ...]]]:
        plans = [frame_plan(view, settings, facts) for view in VIEWS]
        return [[(c.step.name, c.reads, c.writes, c.defines) for c in frame.calls] for frame in plans]

    for path, leaf, value in walk(Settings()):
        other = {"lens.blades": 5, "shading.mode": "unlit", "shading.tone_map": "aces"}.get(path)
        if other is None:
            other = not value if isinstance(value, bool) else [0.1, 0.2, 0.3] if isinstance(value, tuple) else value
            other = leaf.metadata["high"] if other == value else other
        changed = permutations(from_dict({path: other})) != permutations(Settings())
        assert changed == (path in COMPILED), path


# -- the tables --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shader", sorted({p.shader for p in ALL_PASSES}))
def test_every_shader_opens_with_what_it_is_for(shader: str) -> None:
    said = purpose(shader)
    assert re.fullmatch(r"[A-Z][^.]{15,200}\.", said), said


@pytest.mark.parametrize("view", [*VIEWS, *SHOWN])
def test_every_name_of_a_view_or_target_is_known_whatever_the_scene(view: str) -> None:
    check_view(view)


@pytest.mark.parametrize("view", ["hybird", "", "display", "resolved"])
def test_other_names_are_refused_with_those_there_are(view: str) -> None:
    with pytest.raises(
        UserError, match=rf"--view {view}: there is no such view or target; choose one of sharp, .*emissive"
    ):
        check_view(view)


def test_every_target_and_buffer_is_written_and_used_by_some_pass() -> None:
    written = {t for p in ALL_PASSES for t in (*p.writes, *p.updates, *p.offers, *(t for t, _ in p.writes_if))}
    assert written == TARGETS.keys()
    filled, used = {b for p in ALL_PASSES for b in p.fills}, {b for p in ALL_PASSES for b in p.takes}
    assert filled == used == BUFFERS.keys()


def test_passes_name_only_what_exists() -> None:
    for p in ALL_PASSES:
        assert {split_read(r)[1] for r in (*p.reads, *p.optional)} | {*p.history, *p.updates} <= TARGETS.keys(), p.name
        assert {*p.takes, *p.fills} <= BUFFERS.keys(), p.name
        assert not p.grid or p.grid in TARGETS, p.name
        assert p.kind == "raster" or p.writes or p.updates or p.grid, f"{p.name} has no grid"
    assert len({p.name for p in PASSES}) == len(PASSES)


def test_only_history_targets_are_read_as_history() -> None:
    read = {t for p in ALL_PASSES for t in p.history}
    assert read == {t.name for t in TARGETS.values() if t.history}


def test_passes_stay_within_what_opengl_guarantees() -> None:
    for p in ALL_PASSES:
        images = len(p.writes) + len(p.writes_if) + len(p.updates)
        samplers = len(p.reads) + len(p.optional) + len(p.history) + SCENE_SAMPLERS * (p.rays or p.kind == "raster")
        assert images <= LIMIT_IMAGES, p.name
        assert samplers <= LIMIT_SAMPLERS, p.name


@pytest.mark.parametrize("target", TARGETS.values(), ids=lambda t: t.name)
def test_a_target_is_a_format_that_an_image_can_have(target: object) -> None:
    t = TARGETS[target.name]  # type: ignore[attr-defined]
    assert t.components in (1, 2, 4), "a three-component texture cannot be an image"
    assert t.scale >= 1
    assert t.show in SHOW_KINDS
    assert t.range[0] < t.range[1]
    assert len(t.meaning) > 8
    if t.history:
        assert t.dtype != "f1", "8 bits would stall any accumulation"


def test_shader_files_exist_and_none_is_left_over() -> None:
    """Both ways: what a pass names is on disk, and what is on disk is a pass' shader, the window's, or included by one
    of them.
    """
    root = data_dir("glsl")
    files = {f.relative_to(root).as_posix(): f.read_text() for f in root.rglob("*") if f.suffix in SUFFIXES}
    named = {
        s
        for p in ALL_PASSES
        for s in ((p.shader,) if p.kind == "compute" else (f"{p.shader}.vert", f"{p.shader}.frag"))
    }
    assert named <= files.keys()
    app = "".join(f.read_text() for f in data_dir("glsl").parent.glob("app/**/*.py"))
    reached, wanted = set(), [f for f in files if f in named or re.search(rf'"{f.split(".")[0]}[".]', app)]
    while wanted:
        if (file := wanted.pop()) not in reached:
            reached.add(file)
            wanted += re.findall(r'^\s*#include\s+"([^"]+)"', files[file], re.MULTILINE)
    assert reached <= files.keys()
    assert files.keys() - reached == set()


@pytest.mark.parametrize("step", ALL_PASSES, ids=lambda step: step.name)
def test_a_pass_that_reads_the_scenes_records_is_compiled_for_where_they_are(step: Pass) -> None:
    """`scene` hands a pass the defines that say so; without them it would look in an empty block."""
    stages = (step.shader,) if step.shader.endswith(".comp") else (f"{step.shader}.vert", f"{step.shader}.frag")
    texts = [assemble(stage, load_glsl(), {"OBJECTS": 1}).text for stage in stages]
    assert step.scene or not any("RECORDS(" in text for text in texts)


def test_components_that_may_be_negative_exist_and_no_light_that_is_shown_is_among_them() -> None:
    assert all(set(t.signed) <= set("xyzw"[: t.components]) for t in TARGETS.values())
    assert all(t.signed for t in TARGETS.values() if t.show == "signed" and t.range[0] < 0)
    assert not any(TARGETS[name].signed for name in ("lit", "post", "traced", "reference", "emissive", "display"))
