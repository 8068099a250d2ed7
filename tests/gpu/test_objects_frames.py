"""Frames of moving objects: raster and rays see the same place, motion vectors are the exact displacement, and nothing
that moved is left behind.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image

from app.bvh.build import build_bvh
from app.bvh.top import scene_tree
from app.camera import Camera
from app.frame.pipeline import CONVERGING, VIEWS
from app.gpu.records import ROW_BYTES
from app.gpu.scene import GpuScene
from app.renderer import Renderer
from app.scene.flatten import flatten
from app.scene.model import Environment, Light, Material, Scene
from app.settings import Settings, put

from ..image.stage import untimed
from .small_scenes import about, moving, quad, scene_of

SIZE = (97, 61)  # no multiple of a work group, a tile or two
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(50))
STEADY = put(put(Settings(), "temporal.antialias", False), "lens.aperture", 0.0)
PER_SLOPE = SIZE[1] / (2 * math.tan(CAMERA.fov_y / 2))  # px for a slope of 1
SUN = Light("sun", (1.0, 1.0, 1.0), 3.0, direction=(0.0, -0.8, -0.6))
COLORS = [Material((0.8, 0.2, 0.1, 1)), Material((0.1, 0.3, 0.9, 1)), Material((0.7, 0.7, 0.2, 1))]


def turning_and_sliding() -> Scene:
    """A tilted panel that turns about its own middle, one that slides past it, and a wall behind both."""
    panel = quad((-0.9, -0.7, -3.0), (1.1, 0, 0.2), (0, 1.4, 0))
    slider = quad((0.0, -0.5, -2.5), (0.8, 0.1, 0), (0, 0.6, 0.2), material=2)
    wall = quad((-9, -9, -6), (18, 0, 0), (0, 18, 0), material=1)
    scene = scene_of([wall, panel, slider], COLORS, lights=[SUN])
    scene = replace(scene, environment=Environment((0.2, 0.2, 0.2), (0.1, 0.1, 0.1)))
    spin = [about((0.0, 0.8, 0.6), a) for a in (0, 90, 180, 270, 360)]
    scene = moving(scene, 1, turns=spin, pivot=(-0.35, 0.0, -2.9))
    return moving(scene, 2, slide=[(0, 0, 0), (-1.2, 0.4, 0.5)])


def gpu_scene(ctx: moderngl.Context, scene: Scene) -> GpuScene:
    triangles = flatten(scene)
    return GpuScene(ctx, scene, triangles, lambda progress: scene_tree(triangles, build_bvh, progress))


@pytest.fixture(scope="module")
def stage(ctx: moderngl.Context) -> Iterator[GpuScene]:
    scene = gpu_scene(ctx, turning_and_sliding())
    yield scene
    scene.release()


def renderer_of(ctx: moderngl.Context, scene: GpuScene) -> Renderer:
    renderer = untimed(ctx, scene)
    renderer.resize(SIZE)
    return renderer


def frozen(scene: Scene, time_s: float) -> Scene:
    """The same scene as it stands at one time, with nothing that moves."""
    stands = [
        i if i.motion is None else replace(i, transform=i.motion.displacement(time_s) @ i.transform, motion=None)
        for i in scene.instances
    ]
    return replace(scene, instances=tuple(stands))


@pytest.mark.parametrize("time_s", [0.0, 0.7, 2.2])
@pytest.mark.parametrize("view", ["sharp", "traced"])
def test_a_moment_looks_like_a_scene_that_stands_so(
    ctx: moderngl.Context, stage: GpuScene, view: str, time_s: float
) -> None:
    """Light, shadow, normals and places: equal but for pixels whose sample lies within rounding of an edge."""
    still = gpu_scene(ctx, frozen(turning_and_sliding(), time_s))
    pictures = []
    for scene, time in ((stage, time_s), (still, 0.0)):
        renderer = renderer_of(ctx, scene)
        renderer.draw(view, CAMERA, put(STEADY, "rays.samples_per_frame", 1), time_s=time)
        pictures.append(renderer.linear())
        renderer.release()
    still.release()
    difference = np.abs(pictures[0] - pictures[1]).max(axis=-1)
    assert np.mean(difference > 0.02 * pictures[1].max()) < 0.005
    assert pictures[0].std() > 0.01


@pytest.mark.parametrize("time_s", [0.4, 1.3])
def test_raster_and_rays_agree_on_what_moves(ctx: moderngl.Context, stage: GpuScene, time_s: float) -> None:
    """`traced` and `reference` estimate one expectation, and share neither vertices nor visibility."""
    settings = put(put(Settings(), "lens.aperture", 0.15), "lens.focus_distance", 3.0)
    settings = put(settings, "rays.samples_per_frame", 16)
    means = {}
    for view in CONVERGING_VIEWS:
        renderer = renderer_of(ctx, stage)
        runs = []
        for seed in range(4):
            renderer.reset()
            renderer.seed = seed
            for _ in range(4 if view == "traced" else 64):
                renderer.draw(view, CAMERA, settings, time_s=time_s)
            runs.append(renderer.linear())
        renderer.release()
        means[view] = np.array(runs, float)
    a, b = means["traced"], means["reference"]
    error = np.sqrt(a.var(axis=0, ddof=1) / 4 + b.var(axis=0, ddof=1) / 4)
    z = (a.mean(axis=0) - b.mean(axis=0)) / np.maximum(error, 2e-3)
    assert np.mean(np.abs(z) > 5) < 0.01  # Student's t with 6 degrees of freedom passes 5 in 0.25 % of cases
    assert abs(z.mean()) < 0.2


CONVERGING_VIEWS = ("traced", "reference")


def world_of(renderer: Renderer) -> np.ndarray:
    """World position (h, w, 3) under each pixel, float64, from depth."""
    depth = renderer.read("depth")[..., 0].astype(float)
    y, x = np.indices(depth.shape) + 0.5
    right, up = (x - SIZE[0] / 2) / PER_SLOPE, (y - SIZE[1] / 2) / PER_SLOPE
    return np.stack([right * depth, up * depth, -depth], -1)


def screen(points: np.ndarray) -> np.ndarray:
    return points[..., :2] / -points[..., 2:] * PER_SLOPE + np.array(SIZE) / 2


@pytest.mark.parametrize(("now", "before"), [(1.0, 0.95), (0.3, 0.4), (4.1, 3.9)])
def test_motion_vectors_are_the_displacement_in_closed_form(
    ctx: moderngl.Context, stage: GpuScene, now: float, before: float
) -> None:
    """Of a turned and of a slid quad, from float64 formulas of their own; the wall has none. The last pair crosses the
    end of the loop.
    """
    renderer = renderer_of(ctx, stage)
    renderer.draw("motion", CAMERA, STEADY, time_s=before)
    renderer.draw("motion", CAMERA, STEADY, time_s=now)
    motion, objects = renderer.read("motion"), renderer.read("object")[..., 0]
    world = world_of(renderer)
    assert [call.reason for call in renderer.plan.calls if call.step.name == "motion"] == ["objects move"]
    renderer.release()
    slid = world + (before % 4 - now % 4) / 4 * np.array([-1.2, 0.4, 0.5])
    axis, angle = np.array([0.0, 0.8, 0.6]), math.radians(90) * (before - now)
    pivot = np.array([-0.35, 0.0, -2.9])
    arm, c, s = world - pivot, math.cos(angle), math.sin(angle)
    turned = pivot + arm * c + np.cross(axis, arm) * s + axis * (arm @ axis)[..., None] * (1 - c)  # Rodrigues
    for index, earlier in ((0, world), (1, turned), (2, slid)):
        seen = objects == index
        assert seen.sum() > 100
        expected = (screen(world) - screen(earlier))[seen]
        # float16: 2^-11 of the value, and of 1 px near zero; positions in float32 at 100 px
        np.testing.assert_allclose(motion[seen], expected, rtol=2**-10, atol=2e-3)


def test_rays_report_the_same_motion_as_the_raster(ctx: moderngl.Context, stage: GpuScene) -> None:
    """The mean motion of the hybrid's near hits is that of the object they hit."""
    settings = put(put(STEADY, "lens.aperture", 0.3), "lens.focus_distance", 5.0)
    renderer = renderer_of(ctx, stage)
    for time_s in (0.5, 0.55):
        renderer.draw("trace_motion", CAMERA, settings, time_s=time_s)
    got, share = renderer.read("trace_motion"), renderer.read("trace_near")[..., 3]
    renderer.draw("motion", CAMERA, settings, time_s=0.5)
    renderer.draw("motion", CAMERA, settings, time_s=0.55)
    motion, objects = renderer.read("motion"), renderer.read("object")[..., 0]
    renderer.release()
    covered = np.minimum.reduce([objects[y : y + 60 : 2, x : x + 96 : 2] for y in (0, 1) for x in (0, 1)]) == 2
    h, w = covered.shape
    pixels = covered & (share[:h, :w] > 0.999)
    assert pixels.sum() > 20
    # rays of one pixel hit the quad over a disc of a few px, on which its motion changes by less than a tenth
    np.testing.assert_allclose(got[:h, :w][pixels][:, :2], motion[0:60:2, 0:96:2][pixels], rtol=0.1, atol=0.05)


@pytest.mark.parametrize("view", CONVERGING)
def test_a_truth_starts_afresh_when_an_object_moves(ctx: moderngl.Context, stage: GpuScene, view: str) -> None:
    renderer = renderer_of(ctx, stage)
    settings = put(STEADY, "rays.samples_per_frame", 1)
    for _ in range(3):
        renderer.draw(view, CAMERA, settings, time_s=1.0)
    assert renderer.converged_samples == 3
    renderer.draw(view, CAMERA, settings, time_s=1.1)
    assert renderer.converged_samples == 1
    moved = renderer.linear()
    renderer.reset()
    renderer.draw(view, CAMERA, settings, time_s=1.1)
    np.testing.assert_array_equal(renderer.linear(), moved)
    renderer.release()


def test_the_shadow_map_follows_the_objects_and_rests_with_them(ctx: moderngl.Context) -> None:
    scene = gpu_scene(ctx, turning_and_sliding())
    renderer = renderer_of(ctx, scene)
    for time_s, renders in ((0.0, 1), (0.0, 1), (0.5, 2), (0.5, 2), (0.0, 3)):
        renderer.draw("sharp", CAMERA, STEADY, time_s=time_s)
        assert scene.shadow.renders == renders
    renderer.release()
    scene.release()


@pytest.mark.parametrize("view", ["sharp", "post", "hybrid", "traced", "reference"])
@pytest.mark.parametrize("given", [True, False])
def test_the_first_frame_after_a_cut_is_a_fresh_renderers(
    ctx: moderngl.Context, stage: GpuScene, view: str, given: bool
) -> None:
    """Bit for bit; told of the cut, or recognising it by the camera's jump."""
    settings = put(put(Settings(), "lens.aperture", 0.2), "lens.focus_distance", 5.0)
    away = CAMERA if given else CAMERA.turned(math.radians(150), 0.0)
    renderer = renderer_of(ctx, stage)
    for k in range(3):
        renderer.draw(view, away.moved(0.01 * k, 0.0, 0.0), settings, time_s=0.1 * k)
    renderer.draw(view, CAMERA, settings, time_s=1.0, cut=given)
    after, shown = renderer.linear(), renderer.picture()
    renderer.release()
    fresh = renderer_of(ctx, stage)
    fresh.draw(view, CAMERA, settings, time_s=1.0)
    np.testing.assert_array_equal(after, fresh.linear())
    np.testing.assert_array_equal(shown, fresh.picture())
    fresh.release()


def test_what_stands_still_knows_nothing_of_objects(ctx: moderngl.Context) -> None:
    scene = gpu_scene(ctx, frozen(turning_and_sliding(), 0.0))
    renderer = renderer_of(ctx, scene)
    for view in VIEWS:
        renderer.draw(view, CAMERA, Settings(), time_s=1.0)
        renderer.draw(view, CAMERA, Settings(), time_s=2.0)
        assert not renderer.moved
        assert not any(dict(call.defines).get("OBJECTS") for call in renderer.plan.calls)
        assert "object" not in renderer.plan.targets
    assert "Objects" not in {*scene.blocks, *scene.samplers}
    assert "TOP_STACK" not in scene.defines
    rows = -(-64 * build_bvh(*geometry(scene)).stats.inner_nodes // ROW_BYTES)
    assert scene.bytes["BvhNodes"] == rows * ROW_BYTES
    renderer.release()
    scene.release()


def geometry(scene: GpuScene) -> tuple[np.ndarray, np.ndarray]:
    return scene._triangles.positions, scene._triangles.indices


def test_the_last_of_a_shots_frames_shows_its_time(tmp_path: Path) -> None:
    """Of `--fps` only what came before depends; a target without history shows the moment alone."""
    pictures = []
    for name, options in {"a": ["--time", "1"], "b": ["--time", "1", "--fps", "20"], "c": ["--time", "2"]}.items():
        command = [sys.executable, "-m", "app", "shot", "toy-train", "--view", "base_color", "--size", "64x36"]
        command += ["--frames", "3", *options, "-o", str(tmp_path / f"{name}.png")]
        subprocess.run(command, cwd=Path(__file__).parents[2], check=True)
        with Image.open(tmp_path / f"{name}.png") as image:
            pictures.append(np.asarray(image))
            facts = json.loads(image.text["hybrid-dof"])  # type: ignore[attr-defined]
            assert facts["time"] == float(options[1])
            assert facts["fps"] == (20.0 if "--fps" in options else None)
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert (pictures[0] != pictures[2]).any()
