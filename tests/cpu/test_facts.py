"""Facts err on the side of drawing: no circle of confusion that can appear exceeds its bound."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.camera import Camera, look_at, projection
from app.optics import SKY_DEPTH, coc_px, coc_scale_px
from app.scene.facts import (
    MAX_NEAR_PLANE,
    NEAR_SHARE,
    Facts,
    SceneFacts,
    depth_range,
    frame_facts,
    is_cut,
    near_plane,
    scene_facts,
)
from app.scene.model import Instance, Light, Material, Mesh, Scene, TextureSlot
from app.settings import Lens

coordinate = st.floats(-100, 100)
points = st.tuples(coordinate, coordinate, coordinate)
lenses = st.builds(Lens, aperture=st.floats(0, 1), focus_distance=st.floats(1e-2, 1e5))
Vec3 = tuple[float, float, float]
SIZE = (1920, 1080)


def box(a: Vec3, b: Vec3) -> SceneFacts:
    low, high = np.minimum(a, b), np.maximum(a, b)
    return scene_facts(Scene((), (), ()), low, high)


@given(a=points, b=points, eye=points, target=points, lens=lenses, fov=st.floats(5, 120), seed=st.integers(0, 99))
def test_no_point_in_the_picture_exceeds_the_bounds(
    a: Vec3, b: Vec3, eye: Vec3, target: Vec3, lens: Lens, fov: float, seed: int
) -> None:
    assume(math.dist(eye, target) > 1e-3)
    scene, camera = box(a, b), look_at(eye, target, fov_y_deg=fov)
    nearest = near_plane(np.array(scene.low), np.array(scene.high))
    facts = frame_facts(scene, camera, lens, SIZE, nearest)
    share = np.random.default_rng(seed).random((200, 3))
    share[:8] = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3), -1).reshape(8, 3)  # the corners among them
    inside = np.array(scene.low) + share * np.subtract(scene.high, scene.low)
    depths = (inside - camera.eye) @ np.array(camera.forward)
    ahead = depths[depths >= nearest]
    x, y = (camera.axes @ (inside - camera.eye).T)[:2]
    slope = math.tan(camera.fov_y / 2)
    in_picture = (depths >= nearest) & (abs(x) <= slope * SIZE[0] / SIZE[1] * depths) & (abs(y) <= slope * depths)
    seen = np.append(depths[in_picture], SKY_DEPTH)  # the sky is never out of reach
    coc = coc_px(seen, coc_scale_px(lens.aperture, 1080, camera.fov_y), 1.0 / lens.focus_distance)
    rounding = 1e-12 * (1.0 + np.abs(coc).max())
    assert -coc.min() <= facts.near_coc_px + rounding
    assert coc.max() <= facts.far_coc_px + rounding
    low, high = depth_range(camera, scene, nearest)
    assert nearest <= low <= high
    if len(ahead):
        assert low <= ahead.min() + 1e-9
        assert high >= ahead.max() - 1e-9


@given(a=points, b=points, eye=points, target=points, lens=lenses)
def test_bounds_are_not_idle(a: Vec3, b: Vec3, eye: Vec3, target: Vec3, lens: Lens) -> None:
    """Nothing in front of focus: the near bound is 0, so that a plan can leave the rays out."""
    assume(math.dist(eye, target) > 1e-3)
    scene, camera = box(a, b), look_at(eye, target)
    nearest, _ = depth_range(camera, scene, 1e-3)
    facts = frame_facts(scene, camera, lens, SIZE, 1e-3)
    assert facts.near_coc_px >= 0.0
    assert facts.far_coc_px >= 0.0
    if nearest >= lens.focus_distance:
        assert facts.near_coc_px == 0.0
    if lens.aperture == 0.0:
        assert facts.near_coc_px == facts.far_coc_px == 0.0


def test_only_scenes_beyond_the_reach_of_24_bits_are_deep() -> None:
    """There a step of 1/z depth is 1/4096 of the depth: 2 cm at 82 m from a near plane of 2 cm."""
    for diagonal, deep in ((1e-3, False), (6.0, False), (81.0, False), (83.0, True), (1e5, True)):
        size = np.array([diagonal, 0.0, 0.0])
        assert scene_facts(Scene((), (), ()), 0 * size, size).deep == deep
        step = diagonal**2 / (near_plane(0 * size, size) * 2**24)
        assert (step > diagonal / 4096) == deep


@given(diagonal=st.floats(0, 1e6))
def test_the_near_plane_suits_helmets_and_halls(diagonal: float) -> None:
    near = near_plane(np.zeros(3), np.array([diagonal, 0.0, 0.0]))
    assert 0.0 < near <= MAX_NEAR_PLANE
    assert near <= max(NEAR_SHARE * diagonal, 1e-9)


@given(diagonal=st.floats(1e-6, 1e9), share=st.floats(1e-3, 1.0))
def test_the_depth_buffer_tells_surfaces_a_thousandth_of_their_distance_apart(diagonal: float, share: float) -> None:
    """A step of 24 bits at least, from what the projection makes of a depth, to the one a thousandth behind it."""
    far = (diagonal, 0.0, 0.0)
    near = near_plane(np.zeros(3), np.array(far))
    depth = np.array([1.0, 1.001]) * max(share * diagonal, near)
    if scene_facts(Scene((), (), ()), np.zeros(3), np.array(far)).deep:  # as gbuffer.frag
        buffered = np.log2(depth / near) / np.log2(SKY_DEPTH / near)
        assert (buffered[1] - buffered[0]) * 2.0**24 >= 600.0  # ln(1.001) / ln(1e9 / 0.02) of them: 680
    else:
        clip = projection(1.0, 1.0, near) @ np.stack([0 * depth, 0 * depth, -depth, 0 * depth + 1])
        buffered = 0.5 + 0.5 * clip[2] / clip[3]
        assert (buffered[1] - buffered[0]) * 2.0**24 >= 0.998  # 1/1.001 of a step, and rounding


def scene(material: Material, lights: tuple[Light, ...] = (), spare: tuple[Material, ...] = ()) -> Scene:
    one = np.zeros((3, 3), np.float32)
    mesh = Mesh(one, one, one[:, :2], np.zeros((3, 4), np.float32), np.array([[0, 1, 2]], np.uint32), 0)
    return Scene((mesh,), (material, *spare), (Instance(0, np.eye(4)),), lights=lights)


SLOT = TextureSlot(0)


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        (Material(), set()),
        (Material(base_color_texture=SLOT), {"textured"}),
        (Material(metallic_roughness_texture=SLOT), {"textured"}),
        (Material(normal_texture=SLOT), {"textured", "normal_mapped"}),
        (Material(emissive_texture=SLOT), {"textured"}),  # its factor is zero: it emits nothing
        (Material(emissive=(0.0, 0.1, 0.0)), {"emissive"}),
        (Material(alpha_cutoff=0.5), {"alpha_masked"}),
    ],
)
def test_a_material_calls_for_what_it_uses(material: Material, expected: set[str]) -> None:
    flags = ("textured", "normal_mapped", "emissive", "alpha_masked")
    found = scene_facts(scene(material), np.zeros(3), np.ones(3))
    assert {f for f in flags if getattr(found, f)} == expected
    unused = scene_facts(scene(Material(), spare=(material,)), np.zeros(3), np.ones(3))
    assert not any(getattr(unused, f) for f in flags), "a material that no mesh uses calls for nothing"


def test_lights_are_counted_and_frames_inherit_the_scenes_facts() -> None:
    sun, lamp = Light("sun", (1, 1, 1), 1.0), Light("point", (1, 1, 1), 1.0)
    found = scene_facts(scene(Material(normal_texture=SLOT, alpha_cutoff=0.1), (lamp, sun)), np.zeros(3), np.ones(3))
    assert (found.lights, found.sun) == (2, True)
    assert not scene_facts(scene(Material(), (lamp,)), np.zeros(3), np.ones(3)).sun
    frame = frame_facts(found, look_at((0, 0, 5), (0, 0, 0)), Lens(), SIZE, 0.01, camera_moved=True, unsampled=True)
    expected = {
        "textured": True,
        "normal_mapped": True,
        "emissive": False,
        "alpha_masked": True,
        "normal_mapped_in_view": True,
        "alpha_masked_in_view": True,
        "lights": 2,
        "sun": True,
    }
    assert frame == Facts(frame.near_coc_px, frame.far_coc_px, **expected, camera_moved=True, unsampled=True)


ROOM = scene_facts(Scene((), (), ()), np.array([-5.0, 0.0, -5.0]), np.array([5.0, 3.0, 5.0]))
INSIDE = look_at((0, 1.5, 3), (0, 1.5, -5), fov_y_deg=40)


@pytest.mark.parametrize(
    ("now", "cut"),
    [
        (INSIDE, False),
        (INSIDE.moved(0.3, 0.1, 0.5), False),  # a fast step
        (INSIDE.turned(math.radians(20), 0.0), False),
        (replace(INSIDE, fov_y=math.radians(15)), False),  # a zoom shows a part of what was there
        (INSIDE.turned(math.radians(80), 0.0), True),
        (INSIDE.turned(math.pi, 0.0), True),
        (look_at((4, 1.5, -4), (0, 1.5, 4)), True),  # the opposite corner, looking back
        (INSIDE.turned(0.0, math.radians(60)), True),
    ],
)
def test_a_cut_is_a_jump_that_leaves_nothing_on_screen(now: Camera, cut: bool) -> None:
    assert is_cut(INSIDE, now, ROOM, 0.02, (160, 90)) == cut
    assert not is_cut(now, now, ROOM, 0.02, (160, 90))


@given(st.floats(-180, 180), st.floats(-80, 80), st.floats(-4, 4), st.floats(-4, 4), st.integers(0, 99))
def test_no_point_survives_a_cut(yaw: float, pitch: float, right: float, ahead: float, seed: int) -> None:
    """Whatever the room holds: hardly anything seen now lay in the picture before, anywhere on its way to the walls."""
    now = INSIDE.turned(math.radians(yaw), math.radians(pitch)).moved(right, 0.0, ahead)
    if not is_cut(INSIDE, now, ROOM, 0.02, (160, 90)):
        return
    rng = np.random.default_rng(seed)
    nearest, farthest = depth_range(now, ROOM, 0.02)
    z = np.exp(rng.uniform(math.log(nearest), math.log(max(farthest, nearest)), 4000))
    slope = np.array([math.tan(now.fov_y / 2) * 160 / 90, math.tan(now.fov_y / 2)])
    x, y = (rng.uniform(-1, 1, (4000, 2)) * slope * z[:, None]).T
    world = np.stack([x, y, -z, np.ones(4000)], -1) @ np.linalg.inv(now.view()).T
    earlier = world @ INSIDE.view().T
    seen = (np.abs(earlier[:, :2]) <= -earlier[:, 2:3] * slope).all(axis=1)
    seen &= np.einsum("ij,ij->i", world[:, :3] - now.eye, world[:, :3] - INSIDE.eye) > 0.0  # not from behind
    assert seen.mean() < 0.05
