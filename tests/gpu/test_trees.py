"""The tree for rays comes from a thread when it is first asked for, and never if it is not."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import moderngl
import numpy as np
import pytest

from app.bvh.background import Background
from app.bvh.build import Bvh, Progress, build_bvh
from app.bvh.top import scene_tree
from app.camera import look_at
from app.errors import UserError
from app.gpu.scene import GpuScene
from app.panel.model import Look
from app.renderer import Renderer
from app.scene.flatten import flatten
from app.scene.model import Light
from app.settings import Settings, from_dict
from app.window.stage import Stage

from .small_scenes import moving, quad, scene_of

SIZE = (48, 27)
CAMERA = look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
LENS: Settings = from_dict({"lens.aperture": 0.5, "lens.focus_distance": 3.0})
PATIENCE_S = 30.0

Loader = Callable[[Progress | None], Bvh]


def made(ctx: moderngl.Context, loader: Loader | None = None) -> GpuScene:
    """A moving quad in front of a wall, in the sun."""
    quads = [quad((-0.6, -0.6, 1.5), (0.9, 0, 0), (0, 0.9, 0)), quad((-4, -4, -3), (8, 0, 0), (0, 8, 0))]
    sun = Light("sun", (1, 1, 1), 3.0, direction=(0.0, -0.6, -0.8))
    scene = moving(scene_of(quads, lights=[sun]), 0, slide=[(0, 0, 0), (1, 0, 0)])
    triangles = flatten(scene)
    return GpuScene(ctx, scene, triangles, loader or (lambda progress: scene_tree(triangles, build_bvh, progress)))


def waited(scene: GpuScene) -> None:
    end = time.monotonic() + PATIENCE_S
    while not scene.request_tree():
        assert time.monotonic() < end
        time.sleep(0.001)


def builders() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "background"]


def test_a_tree_from_a_thread_is_the_tree(ctx: moderngl.Context) -> None:
    """Every byte of it, and every byte of a picture with it; objects stand where they were placed meanwhile."""
    pictures, records = [], []
    for make_tree in (GpuScene.ensure_bvh, waited):
        scene = made(ctx)
        scene.place(0.7, 0.6)
        make_tree(scene)
        renderer = Renderer(ctx, scene, SIZE)
        renderer.draw("traced", CAMERA, LENS, time_s=0.7)
        pictures.append(renderer.linear())
        held = {**scene.samplers, **scene.blocks}
        records.append({name: held[name].read() for name in ("Triangles", "TrianglePositions", "BvhNodes")})
        assert scene.tree_progress is None
        renderer.release()
        scene.release()
    assert records[0] == records[1]
    assert pictures[0].std() > 0.01
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_asking_does_not_wait_and_tells_how_far_it_is(ctx: moderngl.Context) -> None:
    told, go_on = threading.Event(), threading.Event()

    def loader(progress: Progress | None) -> Bvh:
        assert progress is not None
        progress("building", 0.25)
        told.set()
        assert go_on.wait(PATIENCE_S)
        return scene_tree(triangles, build_bvh, progress)

    scene = made(ctx, loader)
    triangles = scene._triangles
    assert scene.tree_progress is None, "nobody asked"
    assert not scene.request_tree()
    assert told.wait(PATIENCE_S)
    assert scene.tree_progress == ("building", 0.25)
    assert not scene.has_tree
    assert not scene.request_tree()
    assert len(builders()) == 1, "asking again begins nothing"
    heard: list[tuple[str, float]] = []

    def listen(what: str, part: float) -> None:
        heard.append((what, part))
        go_on.set()

    scene.ensure_bvh(listen)
    assert heard[0] == ("building", 0.25)
    assert scene.has_tree
    assert scene.tree_progress is None
    scene.release()


@pytest.mark.parametrize("error", [MemoryError("16 GiB"), UserError("no tree in the file")])
def test_a_tree_that_cannot_be_built_is_told_once_tried_and_holds_nothing_up(
    ctx: moderngl.Context, error: Exception
) -> None:
    tries = []

    def loader(progress: Progress | None) -> Bvh:
        tries.append(1)
        raise error

    scene = made(ctx, loader)
    for _ in range(3):
        with pytest.raises(UserError, match=str(error)):
            waited(scene)
        assert scene.tree_progress is None, "no thread works on it"
    with pytest.raises(UserError, match=str(error)):
        scene.ensure_bvh()
    assert len(tries) == 1
    scene.release()


def test_a_scene_that_goes_leaves_its_thread(ctx: moderngl.Context) -> None:
    """At the next step of its progress."""
    steps = []

    def loader(progress: Progress | None) -> Bvh:
        assert progress is not None
        for k in range(1 << 20):
            steps.append(k)
            progress("building", 0.0)
            time.sleep(0.001)
        raise AssertionError

    scene = made(ctx, loader)
    assert not scene.request_tree()
    scene.release()
    assert not builders()
    assert len(steps) < 1 << 19


# -- on the stage ------------------------------------------------------------------------------------------------------


@pytest.fixture
def stage(ctx: moderngl.Context) -> Iterator[Stage]:
    made = Stage(ctx, lambda text, part: None, compiles=1)
    made.load("toy-train")
    yield made
    made.release()


def turn(stage: Stage, view: str) -> None:
    stage.begin_turn()
    look = Look(view=view, settings=LENS, panel=False)
    if any(stage.pending(look, stage.viewpoints[0].camera, SIZE)):
        stage.draw(look, stage.viewpoints[0].camera, SIZE)


def test_who_asks_and_turns_away_again_gets_the_tree_all_the_same(stage: Stage) -> None:
    """Else the window would wait for it for ever: nothing is measured while a tree is built."""
    turn(stage, "traced")
    assert stage.building
    end = time.monotonic() + PATIENCE_S
    while stage.building:
        turn(stage, "depth")
        assert time.monotonic() < end
        time.sleep(0.001)
    assert stage.gpu_scene is not None
    assert stage.gpu_scene.has_tree
    assert not builders()


# -- the thread --------------------------------------------------------------------------------------------------------


def test_a_background_tells_its_progress_and_its_result() -> None:
    begin, end = threading.Event(), threading.Event()

    def work(progress: Progress) -> int:
        progress("half", 0.5)
        begin.set()
        assert end.wait(PATIENCE_S)
        return 42

    background = Background("begun", work)
    assert begin.wait(PATIENCE_S)
    assert not background.done
    assert background.progress == ("half", 0.5)
    heard: list[tuple[str, float]] = []

    def listen(what: str, part: float) -> None:
        heard.append((what, part))
        end.set()

    background.wait(listen)
    assert background.done
    assert set(heard) == {("half", 0.5)}
    assert background.result() == background.result() == 42


def test_a_background_keeps_what_it_raised() -> None:
    def work(progress: Progress) -> int:
        raise KeyError("lost")

    background = Background("begun", work)
    background.wait()
    for _ in range(2):
        with pytest.raises(KeyError, match="lost"):
            background.result()


def test_who_waits_may_be_interrupted_and_the_work_goes_on() -> None:
    go_on = threading.Event()
    background = Background("begun", lambda progress: go_on.wait(PATIENCE_S))
    assert background.progress == ("begun", 0.0)

    def closed(what: str, part: float) -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        background.wait(closed)
    assert not background.done
    go_on.set()
    assert background.result() is True


def test_a_background_that_is_left_ends_at_its_next_word() -> None:
    begun, reached = threading.Event(), []

    def work(progress: Progress) -> None:
        while True:
            progress("more", 0.5)
            begun.set()
            reached.append(time.sleep(0.001))

    background = Background("begun", work)
    assert begun.wait(PATIENCE_S)
    background.leave()
    assert background.done
    count = len(reached)
    time.sleep(0.01)
    assert len(reached) == count
