"""Programs are ready before a picture needs them: after a rest nothing compiles, before it one program a turn, and no
picture tells the difference.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import moderngl
import numpy as np
import pytest

from app.camera import Camera
from app.errors import UserError
from app.frame.permutations import beside
from app.frame.pipeline import VIEWS, frame_plan
from app.frame.targets import TARGETS
from app.gpu import rehearsal as rehearsals
from app.gpu.execute import try_out
from app.gpu.rehearsal import Rehearsal
from app.panel.model import Look, Shown
from app.renderer import Renderer
from app.settings import Settings, put, walk
from app.window.stage import Stage
from app.window.state import State
from app.window.warmup import WarmUp

from .test_programs import CAMERA, EVERYTHING, NOTHING, SIZE, VIEWABLE, rich_scene

MOST_TURNS = 5000
SCENES = ("still-life", "toy-train")  # textures, alpha, shadows, many lights; moving objects
SHORT = "toy-train"


@dataclass
class Rig:
    """A stage that compiles one program a turn, as the window's."""

    stage: Stage
    state: State
    warm_up: WarmUp
    most: int = 0  # programs, or first runs of them, in one turn

    @property
    def camera(self) -> Camera:
        return self.stage.viewpoints[0].camera

    def turn(self, look: Look, camera: Camera | None = None, time_s: float = 0.0, draws: bool = True) -> int:
        """Draw, or else warm up; returns what was compiled."""
        self.state.look, self.state.camera = look, camera or self.camera
        programs = self.stage.rehearsal.programs
        self.stage.begin_turn()
        before = programs.builds, programs.first_runs
        if draws:
            self.stage.draw(look, self.state.camera, SIZE, time_s)
        else:
            self.warm_up.turn()
        count = max(programs.builds - before[0], programs.first_runs - before[1])
        self.most = max(self.most, count)
        return count

    def draw(self, look: Look, camera: Camera | None = None, time_s: float = 0.0) -> int:
        """Turns until what is asked for was drawn."""
        for turn in range(MOST_TURNS):
            self.turn(look, camera, time_s)
            if not self.stage.preparing:
                return turn + 1
        raise AssertionError(f"{look.view} was never drawn")

    def warm(self, look: Look) -> None:
        for _ in range(MOST_TURNS):
            self.turn(look, draws=False)
            if self.warm_up.done:
                return
        raise AssertionError("never ready")


def made(ctx: moderngl.Context, scene: str) -> Rig:
    stage = Stage(ctx, lambda text, part: None, compiles=1)
    stage.load(scene)
    look = look_at_first(stage)
    state = State(look, Shown())
    return Rig(stage, state, WarmUp(state, stage))


def look_at_first(stage: Stage, view: str = "hybrid") -> Look:
    """A view with the first viewpoint's lens."""
    viewpoint = stage.viewpoints[0]
    settings = put(Settings(), "lens.aperture", viewpoint.aperture)
    return Look(put(settings, "lens.focus_distance", viewpoint.focus_distance), view, panel=False)


@pytest.fixture(scope="module", params=SCENES)
def warm(ctx: moderngl.Context, request: pytest.FixtureRequest, soak: bool) -> Iterator[tuple[Rig, Look]]:
    """A scene, its hybrid picture drawn, and all that is within one step of it ready."""
    if request.param != SHORT and not soak:
        pytest.skip("takes as long again: make soak")
    rig = made(ctx, request.param)
    look = look_at_first(rig.stage)
    rig.draw(look)
    rig.warm(look)
    yield rig, look
    rig.stage.release()


Step = tuple[str, Look, bool]  # what, how it looks, whether the camera moves


def steps_from(look: Look) -> list[Step]:
    """Every single step, standing still and flying."""
    lens = {
        "pinhole": {"lens.aperture": 0.0}, "narrow": {"lens.aperture": 1e-3}, "wide": {"lens.aperture": 1.0},
        "near focus": {"lens.focus_distance": 1e-2}, "far focus": {"lens.focus_distance": 1e6},
    }  # fmt: skip
    looks = [(view, replace(look, view=view)) for view in VIEWABLE]
    looks += [(name, with_settings(look, change)) for name, change in lens.items()]
    looks += [
        (f"{path} = {value}", with_settings(look, {path: value}))
        for path, leaf, present in walk(look.settings)
        for value in beside(leaf, present)
    ]
    looks.append(("split", replace(look, compare=True, other="post")))
    return [(name, other, moves) for name, other in looks for moves in (False, True)]


def with_settings(look: Look, values: dict[str, object]) -> Look:
    settings = look.settings
    for path, value in values.items():
        settings = put(settings, path, value)
    return replace(look, settings=settings)


def test_after_a_rest_no_single_step_compiles_anything(warm: tuple[Rig, Look], soak: bool) -> None:
    rig, look = warm
    steps = steps_from(look)
    for name, other, moves in steps if soak else random.Random(7).sample(steps, 24):
        for frame in range(3):
            camera = rig.camera.moved(0.002 * frame, 0.0, 0.0) if moves else rig.camera
            try:
                compiled = rig.turn(other, camera, 0.01 * frame * moves)
            except UserError:  # a target that this scene has no use for
                break
            assert compiled == 0, f"{name}, moving: {moves}, frame {frame}"
            assert rig.stage.preparing is None, name
        assert rig.turn(look) == 0, f"back from {name}"


def test_a_program_a_turn_is_the_most_that_ever_compiles(warm: tuple[Rig, Look]) -> None:
    assert warm[0].most == 1


def test_a_warm_window_stays_warm_while_it_flies_and_focuses(warm: tuple[Rig, Look]) -> None:
    """Whatever camera and lens: they are of the same few classes, and within one there is nothing left to do."""
    rig, look = warm
    rig.warm(look)
    rng = random.Random(11)
    for reach in (0.02,) * 10 + (2.0,) * 10:
        camera = rig.camera.moved(*(reach * rng.uniform(-0.2, 0.2) for _ in range(3)))
        distance = look.settings.lens.focus_distance * 10.0 ** (reach * rng.uniform(-1.0, 1.0))
        assert rig.turn(with_settings(look, {"lens.focus_distance": distance}), camera) == 0
        assert rig.stage.preparing is None
        assert rig.warm_up.done or reach > 1.0


# -- what is shown meanwhile -------------------------------------------------------------------------------------------


def test_meanwhile_the_nearest_picture_that_is_ready_is_shown(ctx: moderngl.Context) -> None:
    """One program a turn; the tree comes in a thread; the picture never goes away once there is one, gets only nearer
    to what was asked for, and then is what a renderer draws that waits for everything.
    """
    rig = made(ctx, "toy-train")
    look = look_at_first(rig.stage)
    order, shown = ["", "sharp", "post", "hybrid"], [""]
    for _ in range(MOST_TURNS):
        rig.turn(look)
        side = rig.stage.sides[0]
        if side.view != shown[-1]:
            shown.append(side.view)
        assert (side.texture is None) == (side.view == "")
        if not rig.stage.preparing:
            break
        assert rig.stage.preparing[0] or rig.stage.building
    assert shown == [name for name in order if name in shown]
    assert shown[-1] == "hybrid"
    assert len(shown) > 2, "something stood in"
    assert rig.most == 1

    impatient = Renderer(ctx, rig.stage.gpu_scene, SIZE, share_memory=True)  # type: ignore[arg-type]
    impatient.draw("hybrid", rig.camera, look.settings)
    np.testing.assert_array_equal(rig.stage.picture(look), impatient.picture())
    impatient.release()
    rig.stage.release()


def test_what_was_shown_goes_on_while_another_view_is_prepared(ctx: moderngl.Context) -> None:
    rig = made(ctx, "toy-train")
    sharp, traced = look_at_first(rig.stage, "sharp"), look_at_first(rig.stage, "traced")
    rig.draw(sharp)
    frames = rig.stage.sides[0].still
    while True:
        rig.turn(traced)
        if not rig.stage.preparing:
            break
        side = rig.stage.sides[0]
        assert (side.view, side.settings) == ("sharp", sharp.settings)
        assert side.still > frames, "it goes on to converge"
        frames = side.still
    assert rig.stage.sides[0].view == "traced"
    assert rig.most == 1
    rig.stage.release()


def test_a_scene_whose_rays_nobody_asks_for_has_no_tree(ctx: moderngl.Context) -> None:
    rig = made(ctx, "toy-train")
    for view in ("sharp", "post"):
        rig.draw(look_at_first(rig.stage, view))
        rig.warm(look_at_first(rig.stage, view))
    assert rig.warm_up.shown().for_rays > 0
    assert rig.stage.gpu_scene is not None
    assert not rig.stage.gpu_scene.has_tree
    assert rig.stage.gpu_scene._tree_build is None
    rig.stage.release()


def test_programs_that_gave_way_come_back_one_a_turn(ctx: moderngl.Context) -> None:
    """What was found ready is asked again once any program went."""
    rig = made(ctx, "toy-train")
    look = look_at_first(rig.stage, "post")
    rig.draw(look)
    assert rig.turn(look) == 0
    programs = rig.stage.rehearsal.programs
    for key in [key for key in programs._compiled if key[0] == "dof/gather.comp"]:
        programs._drop(key)
    assert rig.draw(look) > 1
    assert rig.most == 1
    rig.stage.release()


# -- rehearsals leave no trace -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scene", "view"), [("still-life", "hybrid"), ("toy-train", "hybrid"), ("toy-train", "reference")]
)
def test_a_picture_is_the_same_with_warming_up_between_its_frames(ctx: moderngl.Context, scene: str, view: str) -> None:
    rig = made(ctx, scene)
    look = look_at_first(rig.stage, view)

    def frames(between: Callable[[], int]) -> tuple[list[np.ndarray], int]:
        """Of a fresh start that stands still, moves, and stands still again; and what was compiled between them."""
        rig.stage.load(scene)
        assert rig.stage.gpu_scene is not None
        rig.stage.gpu_scene.ensure_bvh()  # else it is a matter of chance when a thread has made it
        pictures, count = [], 0
        for moved in (0, 0, 1, 2, 2, 2):
            rig.draw(look, rig.camera.moved(0.01 * moved, 0.0, 0.0), 0.02 * moved)
            pictures += [rig.stage.picture(look), rig.stage.sides[0].renderer.linear()]
            count += sum(between() for _ in range(6))
        return pictures, count

    waiting = rig.stage.renderer(SIZE)  # compiles the programs of these frames: else others would stand in for them
    for moved in (0, 1, 2, 2):
        waiting.draw(view, rig.camera.moved(0.01 * moved, 0.0, 0.0), look.settings, time_s=0.02 * moved)
    waiting.release()
    plain, compiled = frames(lambda: 0)
    assert compiled == 0
    warmed, compiled = frames(lambda: rig.turn(look, draws=False))
    assert compiled >= 16
    for a, b in zip(plain, warmed, strict=True):
        np.testing.assert_array_equal(a, b)
    rig.stage.release()


def test_who_begins_to_fly_sees_the_view_go_on_afresh(ctx: moderngl.Context) -> None:
    """While the programs for motion compile: never another view instead, nor does the picture stand still."""
    rig = made(ctx, "toy-train")
    look = look_at_first(rig.stage)
    rig.draw(look)
    waits = 0
    for frame in range(1, MOST_TURNS):
        camera = rig.camera.moved(1e-4 * frame, 0.0, 0.0)
        compiled = rig.turn(look, camera)
        side = rig.stage.sides[0]
        assert (side.view, side.settings) == ("hybrid", look.settings)
        assert side.drawn[2] == camera
        waits += rig.stage.preparing is not None
        if not compiled and not rig.stage.preparing:
            break
    assert waits > 1
    assert side.renderer.moved, "in the end history counts"
    assert rig.most == 1
    rig.stage.release()


def test_every_part_of_every_view_can_be_tried_out(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a scene with all there is, and a small one: no GL error; work lists are empty, whatever memory held."""
    scene = rich_scene(ctx)
    rehearsal = Rehearsal(ctx, a_turn=1)
    renderer = Renderer(ctx, scene, SIZE, rehearsal=rehearsal)
    lengths = []

    def watched(ctx: moderngl.Context, call, compiled, targets, scene) -> None:  # type: ignore[no-untyped-def]
        for name in call.step.takes:
            lengths.append(np.frombuffer(targets.buffer(name).read(), "<u4").max())
        try_out(ctx, call, compiled, targets, scene)
        for name in (*call.step.takes, *call.step.fills):
            targets.buffer(name).clear(chunk=b"\xff\xff\xff\x7f")

    monkeypatch.setattr(rehearsals, "try_out", watched)
    parts = set()
    for facts in (EVERYTHING, replace(EVERYTHING, objects_moved=False, camera_moved=False), NOTHING):
        for view in (*VIEWS, *TARGETS):
            try:
                calls = frame_plan(view, Settings(), facts).parts
            except UserError:
                continue
            for call in calls:
                turns = 0
                while not renderer.rehearse((call,), view, CAMERA, Settings()):
                    rehearsal.begin_turn()
                    turns += 1
                assert turns <= 2, "one for the program, one for the first of them with shadows"
                assert ctx.error == "GL_NO_ERROR", call.step.name
                parts.add((call.step.name, call.kernels))
            assert not rehearsal.missing(calls, scene)
    assert {name for name, _ in parts} >= {"gather", "post", "trace", "scout", "gradient", "traced", "motion"}
    assert len([1 for name, _ in parts if name == "gather"]) == 5
    assert lengths
    assert not any(lengths)
    renderer.release()
    rehearsal.release()
    scene.release()


def test_the_tree_changes_no_program_but_those_of_rays(ctx: moderngl.Context) -> None:
    rig = made(ctx, "toy-train")
    rig.draw(look_at_first(rig.stage, "post"))
    scene, plan = rig.stage.gpu_scene, rig.stage.sides[0].renderer.plan
    assert scene is not None
    assert plan is not None
    scene.ensure_bvh()
    assert rig.stage.rehearsal.missing(plan.parts, scene) == []
    rig.stage.release()
