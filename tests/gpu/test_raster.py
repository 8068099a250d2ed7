"""The raster path through the renderer: depth, motion, sides, holes, detail and light where the answers are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from app.bvh.build import build_bvh
from app.camera import Camera, look_at, offset, projection
from app.gpu.octahedral import octahedral_decode
from app.gpu.scene import GpuScene
from app.optics import SKY_DEPTH
from app.renderer import Renderer
from app.scene.flatten import flatten
from app.scene.model import Environment, Light, Material, Scene, TextureSlot
from app.settings import Settings, ShadingMode, put

from .passes import run_pass
from .small_scenes import checker, quad, scene_of

SIZE = (64, 48)  # w, h
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(60))
STEADY = put(put(Settings(), "temporal.antialias", False), "lens.aperture", 0.0)
UNLIT = put(STEADY, "shading.mode", ShadingMode.UNLIT)
WALL = quad((-9, -9, -3), (18, 0, 0), (0, 18, 0))  # faces the camera


def render(
    ctx, scene: Scene, targets: Sequence[str], settings: Settings = STEADY, camera: Camera = CAMERA
) -> list[np.ndarray]:
    """The targets of one frame, each (h, w, c), bottom row first."""
    triangles = flatten(scene)
    gpu = GpuScene(ctx, scene, triangles, lambda progress: build_bvh(triangles.positions, triangles.indices))
    renderer = Renderer(ctx, gpu, SIZE)
    renderer.draw("sharp", camera, settings)
    values = [renderer.read(target).copy() for target in targets]
    renderer.release()
    gpu.release()
    return values


def slopes() -> tuple[np.ndarray, np.ndarray]:
    """Right and up per metre of depth, through each pixel's centre (h, w)."""
    y, x = (np.indices((SIZE[1], SIZE[0])) + 0.5) * 2 / np.array([SIZE[1], SIZE[0]])[:, None, None] - 1
    tangent = math.tan(CAMERA.fov_y / 2)
    return x * tangent * SIZE[0] / SIZE[1], y * tangent


def test_depth_is_that_of_the_plane(ctx) -> None:
    floor = quad((-50, -1, 0), (100, 0, 0), (0, 0, -100))
    (depth,) = render(ctx, scene_of([floor]), ["depth"])
    right, up = slopes()
    with np.errstate(divide="ignore"):
        expected = np.where(up < 0, -1 / up, np.inf)
    seen = (expected < 90) & (np.abs(right * expected) < 45)
    # z = h / slope: a float32 plane equation's error of the slope, 2^-24 of 1, is magnified by z.
    np.testing.assert_allclose(depth[seen, 0], expected[seen], rtol=90 * 2**-22)
    assert (depth[up > 0] == SKY_DEPTH).all()


def test_both_sides_are_seen_with_the_normal_towards_the_viewer(ctx) -> None:
    for away, flip in ((False, False), (False, True), (True, False), (True, True)):
        wall = (
            quad((9, -9, -3), (-18, 0, 0), (0, 18, 0), 0, flip)
            if away
            else quad((-9, -9, -3), (18, 0, 0), (0, 18, 0), 0, flip)
        )
        (normal,) = render(ctx, scene_of([wall]), ["normal"])
        np.testing.assert_allclose(
            octahedral_decode(normal[..., :2]), np.broadcast_to([0, 0, 1.0], (*SIZE[::-1], 3)), atol=1e-6
        )
        assert (normal[..., 3] == 1).all()


def test_gbuffer_holds_the_material(ctx) -> None:
    material = Material((0.5, 0.25, 0.125, 1), metallic=0.5, roughness=0.75, emissive=(1, 2, 4))
    base, normal, emissive = render(ctx, scene_of([WALL], [material]), ["base_color", "normal", "emissive"])
    np.testing.assert_array_equal(base, np.broadcast_to([0.5, 0.25, 0.125, 0.5], base.shape))
    np.testing.assert_array_equal(normal[..., 2], 0.75)
    np.testing.assert_array_equal(emissive[..., :3], np.broadcast_to([1, 2, 4], (*SIZE[::-1], 3)))


def test_unlit_shows_colour_light_and_background(ctx) -> None:
    half = quad((0, -9, -3), (9, 0, 0), (0, 18, 0))
    settings = put(UNLIT, "shading.background", (0.1, 0.2, 0.3))
    (lit,) = render(ctx, scene_of([half], [Material((0.5, 0.25, 0.125, 1), emissive=(1, 0, 0))]), ["lit"], settings)
    np.testing.assert_allclose(lit[:, 33:], np.broadcast_to([1.5, 0.25, 0.125, 0], lit[:, 33:].shape), atol=1e-3)
    np.testing.assert_allclose(lit[:, :31], np.broadcast_to([0.1, 0.2, 0.3, 0], lit[:, :31].shape), atol=1e-3)


def test_masked_materials_have_holes(ctx) -> None:
    leaf = Material(alpha_cutoff=0.5, base_color_texture=TextureSlot(0))
    near = quad(
        (-1.5, -1.5, -1), (3, 0, 0), (0, 3, 0), 1
    )  # two texels of the checkerboard across: quarters of the picture
    (depth,) = render(ctx, scene_of([WALL, near], [Material(), leaf], [checker(2, 255, 255, alpha=True)]), ["depth"])
    h, w = SIZE[1], SIZE[0]
    for y, x in (
        (h // 4 - 4, w // 4),
        (3 * h // 4 + 4, w // 4),
        (h // 4 - 4, 3 * w // 4),
        (3 * h // 4 + 4, 3 * w // 4),
    ):
        solid = (y < h / 2) != (x < w / 2)  # texels (0, 1) and (1, 0)
        assert depth[y, x, 0] == pytest.approx(1.0 if solid else 3.0, rel=1e-5)


def test_distant_texture_is_its_mean(ctx) -> None:
    """The level of detail follows the pixel's footprint: a fine checkerboard melts into its linear mean."""
    board = quad((-30, -30, -30), (60, 0, 0), (0, 60, 0))
    (lit,) = render(
        ctx, scene_of([board], [Material(base_color_texture=TextureSlot(0))], [checker(256, 0, 255)]), ["lit"], UNLIT
    )
    np.testing.assert_allclose(lit[..., :3], 0.5, atol=0.01)


def test_near_texture_is_sharp(ctx) -> None:
    board = quad((-100, -100, -1), (200, 0, 0), (0, 200, 0))  # a texel is 32 px wide
    (lit,) = render(
        ctx, scene_of([board], [Material(base_color_texture=TextureSlot(0))], [checker(256, 0, 255)]), ["lit"], UNLIT
    )
    assert lit[..., 0].min() < 4 * 0.5 / 32
    assert lit[..., 0].max() > 1 - 4 * 0.5 / 32


def test_white_furnace(ctx) -> None:
    """In a uniform environment of 1 a white surface of any kind is invisible: it sends back just what it receives."""
    for metallic in (0.0, 1.0):
        for roughness in (0.1, 0.5, 1.0):
            scene = scene_of([WALL], [Material((1, 1, 1, 1), metallic, roughness)])
            (lit,) = render(ctx, replace(scene, environment=Environment((1, 1, 1), (1, 1, 1))), ["lit"])
            np.testing.assert_allclose(lit[..., :3], 1, atol=2**-10)  # a float16 step at 1


def test_sun_lights_and_casts_shadow(ctx) -> None:
    sun = Light("sun", (1, 1, 1), math.pi, direction=(0.0, -1.0, 0.0))
    floor = quad((-20, -1, 0), (40, 0, 0), (0, 0, -40))
    roof = quad((-1, 0.5, -4), (2, 0, 0), (0, 0, -2))
    scene = replace(
        scene_of([floor, roof], [Material((0.5, 0.5, 0.5, 1))], lights=[sun]),
        environment=Environment((0, 0, 0), (0, 0, 0)),
    )
    camera = look_at((0.0, 0.2, 0.0), (0.0, -1.0, -5.0), fov_y_deg=60)
    lit, depth = render(ctx, scene, ["lit", "depth"], camera=camera)
    unshaded, _ = render(ctx, scene, ["lit", "depth"], put(STEADY, "shading.shadows", False), camera)
    right, up = slopes()
    position = np.asarray(camera.eye) + depth * (
        np.asarray(camera.forward) + right[..., None] * camera.right + up[..., None] * camera.true_up
    )
    on_floor = np.abs(position[..., 1] + 1) < 0.01
    x, z = position[..., 0], position[..., 2]
    under = on_floor & (np.abs(x) < 0.9) & (np.abs(z + 5) < 0.9)
    clear = on_floor & ((np.abs(x) > 1.1) | (np.abs(z + 5) > 1.1)) & (depth[..., 0] < 20)
    assert under.sum() > 20
    assert clear.sum() > 200
    np.testing.assert_array_equal(lit[under][:, :3], 0)
    np.testing.assert_array_equal(lit[clear], unshaded[clear])  # no acne, no leaks
    assert lit[clear][:, 0].min() > 0.4
    assert lit[clear][:, 0].max() < 0.65


def test_slopes_do_not_shadow_themselves(ctx) -> None:
    """Every slope under a low sun, alone: any darkening is acne."""
    for tilt in (5, 30, 60, 80):
        c, s = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
        slope = quad((-3, -1, -1), (6, 0, 0), (0, 6 * s, -6 * c))
        sun = Light("sun", (1, 1, 1), 1.0, direction=(0.0, -0.7071067811865476, -0.7071067811865476))
        scene = scene_of([slope], lights=[sun])
        with_map, without = (render(ctx, scene, ["lit"], put(STEADY, "shading.shadows", on))[0] for on in (True, False))
        np.testing.assert_array_equal(with_map, without)


def test_point_light_falls_off_with_the_square(ctx) -> None:
    """A candela 1 m before a matt wall: E = cos / d^2, radiance = albedo E / pi (the fitted specular share aside)."""
    light = Light("point", (1, 1, 1), math.pi, position=(0.0, 0.0, -2.0))
    scene = scene_of([WALL], [Material((1, 1, 1, 1), roughness=1.0)], lights=[light])
    (lit,) = render(ctx, replace(scene, environment=Environment((0, 0, 0), (0, 0, 0))), ["lit"])
    right, up = slopes()
    distance = np.sqrt((3 * right) ** 2 + (3 * up) ** 2 + 1)
    diffuse = lit[..., 0] - lit[..., 3]  # white light on a white wall: alpha is the specular part
    np.testing.assert_allclose(
        diffuse * distance**3, np.median(diffuse * distance**3), rtol=0.08
    )  # the base dims towards grazing
    assert 0.85 < diffuse.max() < 1.0


def test_motion_of_a_shifted_camera(ctx) -> None:
    """Moving right by 0.1 m shifts what is at depth z left by 0.1 H / (2 z tan(fov/2)) px, and the sky not at all."""
    h, w = 48, 64
    depth = np.full((h, w, 1), 4.0, np.float32)
    depth[h // 2 :] = SKY_DEPTH
    now, before = CAMERA.moved(0.1, 0.0, 0.0), CAMERA
    jitter = (0.25, -0.125)
    got = run_pass(
        ctx,
        "raster/motion.comp",
        {"in_depth": depth},
        ("out_motion", "float16", 2),
        motion_frame(now, before, w, h, jitter),
    )
    expected = -0.1 * h / (2 * 4.0 * math.tan(CAMERA.fov_y / 2))
    np.testing.assert_allclose(got[: h // 2, :, 0], expected, atol=2e-3)  # float16 at 1.04
    np.testing.assert_allclose(got[h // 2 :], 0, atol=1e-3)
    np.testing.assert_allclose(got[..., 1], 0, atol=1e-3)


def test_motion_of_a_turned_camera_is_the_same_at_all_depths(ctx) -> None:
    h, w = 48, 64
    near, sky = np.full((h, w, 1), 2.0, np.float32), np.full((h, w, 1), SKY_DEPTH, np.float32)
    frame = motion_frame(CAMERA.turned(0.01, 0.02), CAMERA, w, h, (0.0, 0.0))
    a, b = (
        run_pass(ctx, "raster/motion.comp", {"in_depth": d}, ("out_motion", "float16", 2), frame) for d in (near, sky)
    )
    np.testing.assert_allclose(a, b, atol=4e-3)  # two float32 projections, one float16 step at 2
    assert np.abs(a).min() > 0.2


@pytest.mark.parametrize("nearer_first", [False, True])
@pytest.mark.parametrize("distance", [1.0, 30.0, 1e3, 3e4, 1e6])
def test_the_nearer_surface_hides_the_other_however_far(ctx, distance: float, nearer_first: bool) -> None:
    """A thousandth of their distance apart, in a scene that reaches far enough for each."""
    walls = [
        quad((-z, -z, -z), (2 * z, 0, 0), (0, 2 * z, 0), material)
        for z, material in ((distance, 0), (1.001 * distance, 1))
    ]
    scene = scene_of(walls if nearer_first else walls[::-1], [Material((1, 0, 0, 1)), Material((0, 1, 0, 1))])
    base_color, depth = render(ctx, scene, ["base_color", "depth"])
    np.testing.assert_array_equal(base_color[..., :3], np.broadcast_to([1.0, 0.0, 0.0], (*base_color.shape[:2], 3)))
    np.testing.assert_allclose(depth, distance, rtol=1e-5)


def motion_frame(now: Camera, before: Camera, w: int, h: int, jitter: tuple[float, float]) -> dict[str, object]:
    project = projection(now.fov_y, w / h, 0.01)
    return {
        "view": now.view().T,
        "view_to_world": np.linalg.inv(now.view()).T,
        "view_proj": (offset(jitter, (w, h)) @ project @ now.view()).T,
        "this_view_proj": (project @ now.view()).T,
        "prev_view_proj": (project @ before.view()).T,
        "lens_eye": now.eye,
        "jitter_px": jitter,
        "tan_half_fov_y": math.tan(now.fov_y / 2),
    }
