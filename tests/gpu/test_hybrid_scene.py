"""The whole hybrid on scenes whose answer is known: a straight edge before a wall in focus."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.bvh.build import build_bvh
from app.bvh.top import scene_tree
from app.camera import Camera, look_at
from app.gpu.scene import GpuScene
from app.optics import coc_px, coc_scale_px
from app.renderer import Renderer
from app.scene.flatten import flatten
from app.scene.model import Material
from app.settings import Settings, ShadingMode, put

from . import hybrid_twin as twin
from .small_scenes import moving, quad, scene_of

SIZE = (160, 96)
NEAR_M, FAR_M = 1.0, 4.0
RED, GREEN = (0.8, 0.1, 0.1, 1.0), (0.1, 0.6, 0.1, 1.0)
CAMERA = look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
FRAMES = 16


def settings(aperture: float = 0.15, focus: float = FAR_M) -> Settings:
    result = put(put(Settings(), "shading.mode", ShadingMode.UNLIT), "mask.settle", False)
    return put(put(result, "lens.aperture", aperture), "lens.focus_distance", focus)


@pytest.fixture(scope="module")
def half_plane(ctx: moderngl.Context) -> GpuScene:
    """A red quad that ends at x = 0 before a green wall."""
    edge = quad((-50.0, -50.0, -NEAR_M), (50.0, 0.0, 0.0), (0.0, 100.0, 0.0), 0)
    wall = quad((-50.0, -50.0, -FAR_M), (100.0, 0.0, 0.0), (0.0, 100.0, 0.0), 1)
    triangles = flatten(scene := scene_of([edge, wall], [Material(base_color=RED), Material(base_color=GREEN)]))
    return GpuScene(ctx, scene, triangles, lambda progress: build_bvh(triangles.positions, triangles.indices))


def drawn(ctx: moderngl.Context, scene: GpuScene, view: str, options: Settings, cameras: list[Camera]) -> Renderer:
    renderer = Renderer(ctx, scene, SIZE)
    for camera in cameras:
        renderer.draw(view, camera, options)
    return renderer


def edge_radius_px() -> float:
    return float(-coc_px(NEAR_M, coc_scale_px(0.15, SIZE[1], CAMERA.fov_y), 1.0 / FAR_M))


def expected_ratio() -> np.ndarray:
    """Part of the lens that the half plane covers, per half-res column: a circular segment, averaged over 2 px."""
    columns = (np.arange(SIZE[0] // 2)[:, None] + (np.arange(8) + 0.5) / 8) * 2.0
    return twin.segment_share((columns - SIZE[0] / 2) / edge_radius_px()).mean(1)


def test_hit_ratio_beside_a_straight_edge_is_a_circular_segment(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    renderer = drawn(ctx, half_plane, "hybrid", settings(), [CAMERA] * FRAMES)
    ratio, mask = renderer.read("layer_state")[..., 2], renderer.read("mask")[..., 0] > 0.0
    rays = renderer.read("ray_count")[..., 0]
    renderer.release()
    columns = mask.all(0)
    reached = np.abs(np.arange(SIZE[0] // 2) + 0.5 - SIZE[0] / 4) <= edge_radius_px() / 2
    assert columns[reached].all()
    assert rays[mask].mean() == pytest.approx(4.0, rel=0.02)
    error = ratio[:, columns] - expected_ratio()[columns]
    # Independent rays would scatter by sqrt(r (1 - r) / n) <= 0.0625; stratified ones by less; 48 rows by less still.
    assert np.sqrt((error**2).mean()) < 0.5 / np.sqrt(4.0 * FRAMES)
    assert np.abs(error.mean(0)).max() < 4.0 * 0.5 / np.sqrt(4.0 * FRAMES * len(error))


def test_the_picture_is_right_in_closed_form(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    share = twin.segment_share((np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) / edge_radius_px())[:, None]
    renderer = drawn(ctx, half_plane, "hybrid", settings(), [CAMERA] * FRAMES)
    error = np.abs(renderer.linear() - (share * np.array(RED[:3]) + (1.0 - share) * np.array(GREEN[:3])))
    renderer.release()
    assert error.mean() < 0.002


def test_what_the_edge_hides_is_seen_through_its_blur(ctx: moderngl.Context) -> None:
    """Stripes behind the edge, which no raster image holds: the rays find them, the post-process cannot."""
    stripes = [quad((-5.0 + 0.5 * i, -9.0, -FAR_M), (0.5, 0.0, 0.0), (0.0, 18.0, 0.0), 1 + i % 2) for i in range(20)]
    edge = quad((-50.0, -50.0, -NEAR_M), (50.0, 0.0, 0.0), (0.0, 100.0, 0.0), 0)
    colors = [Material(base_color=c) for c in (RED, GREEN, (0.9, 0.9, 0.9, 1.0))]
    triangles = flatten(scene := scene_of([edge, *stripes], colors))
    gpu_scene = GpuScene(ctx, scene, triangles, lambda progress: build_bvh(triangles.positions, triangles.indices))
    pictures = {}
    for view, frames in (("traced", 128), ("post", FRAMES), ("hybrid", FRAMES)):
        renderer = drawn(ctx, gpu_scene, view, settings(), [CAMERA] * frames)
        pictures[view] = renderer.linear()
        renderer.release()
    errors = {view: float(np.abs(picture - pictures["traced"]).mean()) for view, picture in pictures.items()}
    assert errors["hybrid"] < 0.5 * errors["post"]


def test_without_anything_near_the_hybrid_is_the_post_process(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    options = settings(focus=NEAR_M)
    pictures = []
    for view in ("post", "hybrid"):
        renderer = drawn(ctx, half_plane, view, options, [CAMERA] * 2)
        pictures.append(renderer.linear())
        renderer.release()
    np.testing.assert_array_equal(*pictures)


def test_same_inputs_same_bytes(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    cameras = [CAMERA, CAMERA, CAMERA.moved(0.01, 0.0, 0.02), CAMERA.moved(0.02, 0.0, 0.04)]
    pictures = []
    for _ in range(2):
        renderer = drawn(ctx, half_plane, "hybrid", settings(), cameras)
        pictures.append(renderer.linear().tobytes())
        renderer.release()
    assert pictures[0] == pictures[1]


def test_hits_move_on_screen_as_the_camera_makes_them(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    """A sidestep moves a point at depth z by H / (2 z tan(fov/2)) px per metre."""
    step = 0.01
    renderer = drawn(ctx, half_plane, "hybrid", settings(), [CAMERA, CAMERA.moved(step, 0.0, 0.0)])
    motion, near, rays = (
        renderer.read("trace_motion"),
        renderer.read("trace_near")[..., 3],
        renderer.read("ray_count")[..., 0],
    )
    picture = renderer.linear()
    renderer.release()
    per_metre = SIZE[1] / (2.0 * np.tan(CAMERA.fov_y / 2.0))
    hit_near, hit_far = (rays > 0) & (near > 0.0), (rays > 0) & (near < 1.0)
    assert hit_near.any()
    assert hit_far.any()
    np.testing.assert_allclose(motion[hit_near][:, 0], -step * per_metre / NEAR_M, rtol=2e-3)
    np.testing.assert_allclose(motion[hit_far][:, 2], -step * per_metre / FAR_M, rtol=2e-3, atol=1e-3)
    assert np.isfinite(picture).all()


def test_the_layers_follow_a_moving_camera(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    """While the camera sidesteps at constant speed the edge's blur stays as it is, only elsewhere: no trail, no lag."""
    speed = 0.02
    cameras = [CAMERA.moved(speed * (i - 11), 0.0, 0.0) for i in range(12)]
    renderer = drawn(ctx, half_plane, "hybrid", settings(), cameras)
    ratio, mask = renderer.read("layer_state")[..., 2], renderer.read("mask")[..., 0] > 0.0
    renderer.release()
    columns = mask.all(0)
    error = (ratio[:, columns] - expected_ratio()[columns]).mean(0)
    # One frame's step is 2.3 px, 0.15 of the blur's radius: each frame of lag would put the edge off by a tenth.
    assert np.abs(error).max() < 0.06


def test_all_targets_are_finite_in_the_light(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    options = put(settings(), "shading.mode", ShadingMode.LIT)
    renderer = drawn(
        ctx, half_plane, "hybrid", options, [CAMERA, CAMERA.moved(0.3, 0.1, 0.8), CAMERA.moved(0.3, 0.1, -3.0)]
    )
    for target in ("mask_edges", "mask", "near_layer", "far_layer", "layer_state", "near_light", "far_light", "hybrid"):
        assert np.isfinite(renderer.read(target)).all(), target
    renderer.release()


def gradients(ctx: moderngl.Context, scene: GpuScene, cameras: list[Camera], times: list[float]) -> np.ndarray:
    """What stored rays told in the last frame, near and far, where they told anything."""
    renderer = Renderer(ctx, scene, SIZE)
    for camera, time_s in zip(cameras, times):
        renderer.draw("hybrid", camera, settings(aperture=0.5), time_s=time_s)
    values = renderer.read("gradient")
    renderer.release()
    return np.asarray(values[values >= 0.0])


def test_a_still_world_has_no_gradient_however_the_camera_moves(ctx: moderngl.Context, half_plane: GpuScene) -> None:
    """Each stored hit still sends what it sent, except one that lies on the very edge, where rounding decides."""
    cameras = [CAMERA, CAMERA.moved(0.01, 0.005, 0.02).turned(0.002, 0.001)]
    found = gradients(ctx, half_plane, cameras, [0.0, 0.0])
    assert len(found) > 100
    assert (found > 1e-6).mean() < 0.01


def test_what_comes_between_is_a_gradient(ctx: moderngl.Context) -> None:
    """A blue quad slides before the wall: stored rays to the wall behind it now end on it."""
    edge = quad((-50.0, -50.0, -NEAR_M), (50.0, 0.0, 0.0), (0.0, 100.0, 0.0), 0)
    wall = quad((-50.0, -50.0, -FAR_M), (100.0, 0.0, 0.0), (0.0, 100.0, 0.0), 1)
    slider = quad((0.6, -0.5, -3.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2)
    colors = [Material(base_color=c) for c in (RED, GREEN, (0.05, 0.05, 0.9, 1.0))]
    scene = moving(scene_of([edge, wall, slider], colors), 2, slide=[(0.0, 0.0, 0.0), (-4.0, 0.0, 0.0)])
    triangles = flatten(scene)
    tree = lambda progress: scene_tree(triangles, build_bvh, progress)  # noqa: E731
    gpu_scene = GpuScene(ctx, scene, triangles, tree)
    rest = gradients(ctx, gpu_scene, [CAMERA, CAMERA.moved(0.001, 0.0, 0.0)], [0.0, 0.0])
    moved = gradients(ctx, gpu_scene, [CAMERA, CAMERA], [0.0, 0.5])
    gpu_scene.release()
    before, now = (0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2] for c in (GREEN, (0.05, 0.05, 0.9)))
    change = float(twin.light_change(before / (1.0 + before), now / (1.0 + now)))
    told = [int(np.isclose(values, change, atol=2e-3).sum()) for values in (rest, moved)]
    assert told[0] == 0
    assert told[1] >= 5  # of some 20 blocks of 3x3 half-res px that the quad newly covers, those with a far ray stored


def test_scouts_find_what_blurs_in_from_beyond_the_picture(ctx: moderngl.Context) -> None:
    """A red quad ends 1 px outside the left rim: no pixel shows it, yet its blur covers an eighth of the picture."""
    left = -NEAR_M * np.tan(CAMERA.fov_y / 2.0) * SIZE[0] / SIZE[1] * (1.0 + 2.0 / SIZE[0])
    edge = quad((left - 50.0, -50.0, -NEAR_M), (50.0, 0.0, 0.0), (0.0, 100.0, 0.0), 0)
    wall = quad((-50.0, -50.0, -FAR_M), (100.0, 0.0, 0.0), (0.0, 100.0, 0.0), 1)
    triangles = flatten(scene := scene_of([edge, wall], [Material(base_color=RED), Material(base_color=GREEN)]))
    gpu_scene = GpuScene(ctx, scene, triangles, lambda progress: build_bvh(triangles.positions, triangles.indices))
    pictures = {}
    wide, radius = settings(aperture=0.5), edge_radius_px() * 0.5 / 0.15
    for name, options in (("scouts", wide), ("none", put(wide, "mask.scouts", False))):
        renderer = drawn(ctx, gpu_scene, "hybrid", options, [CAMERA] * 32)
        pictures[name] = renderer.linear()
        renderer.release()
    gpu_scene.release()
    share = twin.segment_share((np.arange(SIZE[0]) + 0.5 + 1.0) / radius)[:, None]
    truth = share * np.array(RED[:3]) + (1.0 - share) * np.array(GREEN[:3])
    near_rim = slice(0, int(radius) // 2)
    errors = {
        name: np.abs((picture - truth).mean(0)[near_rim]).mean() for name, picture in pictures.items()
    }  # no noise
    assert errors["none"] > 0.05
    assert errors["scouts"] < 0.1 * errors["none"]
