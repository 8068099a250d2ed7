"""What is made ready for the next step is what that step asks for, whichever it is, and is bounded."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from functools import lru_cache
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import settings as effort
from hypothesis import strategies as st

from app.errors import UserError
from app.frame.mask import RAYS_BEGIN_PX
from app.frame.permutations import LENSES, of_its_class, within_one_step
from app.frame.pipeline import LENS_RAYS, VIEWS, frame_plan
from app.frame.records import Call
from app.frame.targets import TARGETS
from app.gpu.programs import MOST_PROGRAMS
from app.gpu.reachable import of_frame, reachable
from app.gpu.shaders import load_glsl
from app.optics import IN_FOCUS_COC_PX
from app.scene.facts import Facts, frame_facts, near_plane, scene_facts
from app.scene.flatten import bounds
from app.scene.gallery import SCENES
from app.session import focused, open_scene, viewpoints
from app.settings import Settings, from_dict, put, walk

RICH = Facts(
    near_coc_px=30.0, far_coc_px=30.0, textured=True, normal_mapped=True, emissive=True, alpha_masked=True, lights=2,
    sun=True, objects=True, deep=True,
)  # fmt: skip
PLAIN = Facts(near_coc_px=0.0, far_coc_px=5.0)
PINHOLE = replace(RICH, near_coc_px=0.0, far_coc_px=0.0)
CHANGED = {
    "lens.spherical_aberration": 0.5, "lens.cat_eye": 0.3, "lens.blades": 7, "post.rings": 6, "shading.mode": "unlit",
    "post.slight_focus": False, "reconstruct.gradients": False, "temporal.antialias": False, "overlay.focus_plane":
    True,
}  # fmt: skip
# Views, settings and scenes from which a step is taken.
STARTS: tuple[tuple[str, Settings, Facts], ...] = (
    *((view, Settings(), RICH) for view in VIEWS),
    ("hybrid", put(Settings(), "lens.aperture", 0.0), PINHOLE),
    ("post", from_dict(CHANGED), RICH),
    ("traced", from_dict(CHANGED), PLAIN),
    ("near_blur", Settings(), replace(PLAIN, near_coc_px=3.0)),
)
SHOWABLE = (*VIEWS, *(t for t in TARGETS if t not in VIEWS and t not in ("display", "resolved")))
EDGES_PX = (0.0, IN_FOCUS_COC_PX, RAYS_BEGIN_PX)
coc = st.one_of(
    st.floats(0.0, 2e6),
    st.floats(0.0, 4.0),
    st.sampled_from([e * (1.0 + d) for e in EDGES_PX for d in (-(2**-52), 0.0, 2**-52)]),
)


def asks_for(call: Call) -> tuple[object, ...]:
    """What a driver compiles for: the program, and what it reads and writes."""
    return call.program, call.reads, call.step.history, call.writes


@lru_cache
def ready(start: int) -> frozenset[object]:
    """Of all that is within one step."""
    return frozenset(asks_for(call) for call in within_one_step(*STARTS[start]))


def other_value(draw: st.DrawFn, leaf: Any, value: Any) -> Any:
    """A value that one action can give a setting: a click on a switch, a choice, a step or `default`; a slider drawn
    anywhere.
    """
    low, high = leaf.metadata["low"], leaf.metadata["high"]
    if isinstance(value, bool):
        return not value
    if isinstance(value, Enum):
        return draw(st.sampled_from(type(value)))
    if isinstance(value, int):
        return draw(st.sampled_from([max(value - 1, low), min(value + 1, high), leaf.default]))
    if isinstance(value, float):
        return draw(st.one_of(st.sampled_from([low, high, leaf.default]), st.floats(low, high)))
    return tuple(draw(st.floats(low, high)) for _ in value)


@st.composite
def steps(draw: st.DrawFn) -> tuple[int, str, Settings, Facts]:
    """A start, and what is asked for one step from there, still or moving."""
    start = draw(st.integers(0, len(STARTS) - 1))
    view, settings, facts = STARTS[start]
    kind = draw(st.sampled_from(["view", "lens", "setting"]))
    if kind == "view":
        view = draw(st.sampled_from(SHOWABLE))
    elif kind == "lens":
        settings = put(settings, "lens.aperture", draw(st.floats(2**-20, 1.0)))
        settings = put(settings, "lens.focus_distance", draw(st.floats(1e-3, 1e6)))
        facts = replace(facts, near_coc_px=draw(coc), far_coc_px=draw(coc))
    else:
        path, leaf, value = draw(st.sampled_from(list(walk(settings))))
        settings = put(settings, path, other_value(draw, leaf, value))
        if settings.lens.aperture == 0.0:
            facts = replace(facts, near_coc_px=0.0, far_coc_px=0.0)
        elif path in ("lens.aperture", "lens.focus_distance"):  # which the circles of confusion depend on
            facts = replace(facts, near_coc_px=draw(coc), far_coc_px=draw(coc))
    facts = replace(
        facts,
        camera_moved=draw(st.booleans()),
        objects_moved=facts.objects and draw(st.booleans()),
        unsampled=view in LENS_RAYS and draw(st.booleans()),
    )
    return start, view, settings, facts


OPENED = 5, "hybrid", put(Settings(), "lens.aperture", 0.02), RICH
ROUND = 6, "post", put(STARTS[6][1], "lens.spherical_aberration", 0.0), RICH
COARSE = 6, "post", put(STARTS[6][1], "post.rings", 4), RICH


@pytest.mark.parametrize("start", range(len(STARTS)))
def test_where_one_stands_is_among_it(start: int) -> None:
    assert {asks_for(call) for call in frame_plan(*STARTS[start]).parts} <= ready(start)


@given(step=steps())
@example(step=OPENED)
@example(step=ROUND)
@example(step=COARSE)
@effort(max_examples=400, deadline=None)
def test_whatever_one_step_asks_for_is_listed(step: tuple[int, str, Settings, Facts]) -> None:
    start, view, settings, facts = step
    try:
        parts = frame_plan(view, settings, facts).parts
    except UserError:  # a target that nothing writes there
        return
    missing = [call.step.name for call in parts if asks_for(call) not in ready(start)]
    assert not missing, f"from {STARTS[start][0]} to {view}"


@given(step=steps(), view=st.sampled_from(SHOWABLE), near=coc, far=coc)
@effort(max_examples=400, deadline=None)
def test_what_is_of_one_class_plans_the_same(
    step: tuple[int, str, Settings, Facts], view: str, near: float, far: float
) -> None:
    """Calls are equal in all but their reasons, which name the blur."""
    _, _, settings, facts = step
    if settings.lens.aperture:
        facts = replace(facts, near_coc_px=near, far_coc_px=far)
    same = of_its_class(settings, facts)
    assert of_its_class(*same) == same
    assert (same[1].near_coc_px, same[1].far_coc_px) in LENSES
    assert planned(view, settings, facts) == planned(view, *same)


@given(near=st.floats(3.0, 1e6), focus=st.floats(0.01, 100.0), aperture=st.floats(1e-3, 0.9))
def test_flying_and_focusing_stay_in_a_class(near: float, focus: float, aperture: float) -> None:
    settings = put(put(Settings(), "lens.focus_distance", focus), "lens.aperture", aperture)
    usual = put(put(Settings(), "lens.focus_distance", 3.0), "lens.aperture", 0.01)
    assert of_its_class(settings, replace(RICH, near_coc_px=near)) == of_its_class(usual, RICH)


def planned(view: str, settings: Settings, facts: Facts) -> object:
    try:
        frame = frame_plan(view, settings, facts)
    except UserError:
        return None
    return [(asks_for(call), call.in_place) for call in frame.parts], [skipped.name for skipped in frame.skipped]


# -- how many ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [built_in.name for built_in in SCENES])
def test_the_programs_of_a_step_are_few(scene: str) -> None:
    model, triangles = open_scene(scene)
    box = bounds(triangles)
    viewpoint = viewpoints(model, box)[0]
    settings = focused(Settings(), viewpoint)
    facts = frame_facts(scene_facts(model, *box), viewpoint.camera, settings.lens, (1280, 720), near_plane(*box))
    check_few(settings, facts, ("post", "hybrid"))


@pytest.mark.parametrize("settings", [Settings(), from_dict(CHANGED)], ids=["default", "changed"])
def test_the_programs_of_a_step_are_few_in_the_richest_scene(settings: Settings) -> None:
    check_few(settings, RICH, tuple(VIEWS))


def check_few(settings: Settings, facts: Facts, views: tuple[str, ...]) -> None:
    """A split screen of any two finds room for all that either can ask for next, and for as much again."""
    files = load_glsl()
    within = {view: reachable(view, settings, facts, files) for view in views}
    for view in views:
        assert of_frame(view, settings, facts, files) <= within[view]
        for other in views:
            assert 2 * len(within[view] | within[other]) <= MOST_PROGRAMS, (view, other)
