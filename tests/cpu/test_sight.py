"""Boxes and what is seen of them err on the side of seeing: no surface that a pixel's rays meet is missed or nearer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.camera import Camera, look_at
from app.optics import lens_point
from app.scene.boxes import ALPHA_MASKED, ANYTHING, MOST_BOXES, NORMAL_MAPPED, Boxes, scene_boxes, single_box
from app.scene.facts import near_plane
from app.scene.flatten import bounds, flatten
from app.scene.model import Material, Mesh, Scene, TextureSlot, Triangles
from app.scene.sight import sight
from app.scene.stress.catalogue import STRESS
from app.session import open_scene
from app.settings import Lens

from ..gpu.small_scenes import moving, quad, scene_of

SIZE = (160, 90)
PINHOLE = Lens(aperture=0.0, focus_distance=1.0)
MATERIALS = (Material(), Material(alpha_cutoff=0.5), Material(normal_texture=TextureSlot(0)))


def soup(rng: np.random.Generator, count: int, spread: float, at: float) -> Triangles:
    """Triangles of all sizes and every kind, some flat along an axis, around a place as far as `at` from the origin."""
    middle = rng.uniform(-1, 1, (count, 1, 3)) * spread
    corners = middle + rng.uniform(-1, 1, (count, 3, 3)) * 10.0 ** rng.uniform(-3, 0.5, (count, 1, 1)) * spread
    flat = rng.random(count) < 0.4
    corners[flat, :, 1] = corners[flat, :1, 1]
    place = rng.uniform(-1, 1, 3) * at
    meshes = []
    for kind in range(len(MATERIALS)):
        own = (corners[kind :: len(MATERIALS)] + place).reshape(-1, 3).astype(np.float32)
        plain = np.tile(np.array([0, 1, 0, 1], np.float32), (len(own), 1))
        faces = np.arange(len(own), dtype=np.uint32).reshape(-1, 3)
        meshes.append(Mesh(own, plain[:, :3].copy(), plain[:, :2].copy(), plain, faces, kind))
    return flatten(scene_of(meshes, MATERIALS))


def corners_of(triangles: Triangles) -> np.ndarray:
    return triangles.positions[triangles.indices].astype(np.float64) + triangles.origin


def points_on(triangles: Triangles, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (count, 3) on triangles that stand still, their corners and edges among them, and which triangles."""
    which = rng.integers(0, len(triangles.indices), count)
    weights = rng.dirichlet([0.4] * 3, count)
    weights[: count // 4] = np.eye(3)[rng.integers(0, 3, count // 4)]
    return np.einsum("ij,ijk->ik", weights, corners_of(triangles)[which]), which


def kinds_of(triangles: Triangles) -> np.ndarray:
    return np.array([0, ALPHA_MASKED, NORMAL_MAPPED])[triangles.materials[triangles.indices[:, 0]]]


def check(
    boxes: Boxes, triangles: Triangles, camera: Camera, lens: Lens, near: float, rng: np.random.Generator
) -> None:
    """Of places on triangles, those that some lens point shows within the picture."""
    seen = sight(boxes, camera, lens, SIZE, near)
    places, which = points_on(triangles, rng, 4000)
    x, y, z = camera.axes @ (places - camera.eye).T
    z = -z
    u, v = 0.5 * lens.aperture * lens_point(rng.random((len(z), 2))).T
    t = math.tan(camera.fov_y / 2)
    shift = 1.0 - z / lens.focus_distance
    shown = (z >= near) & (abs(x - u * shift) <= t * SIZE[0] / SIZE[1] * z) & (abs(y - v * shift) <= t * z)
    if shown.any():
        assert seen.nearest <= z[shown].min() * (1.0 + 1e-12)
        assert not np.bitwise_or.reduce(kinds_of(triangles)[which[shown]]) & ~seen.kinds


numbers = st.integers(0, 2**32 - 1)


@pytest.fixture
def examples(soak: bool) -> int:
    return 20_000 if soak else 150


@pytest.mark.parametrize("at", [0.0, 1e5])
def test_nothing_shown_is_missed_or_nearer(at: float, examples: int) -> None:
    """From outside, from within the boxes, straight down, and through every lens."""

    @settings(max_examples=examples, deadline=None)
    @given(
        seed=numbers,
        fov=st.floats(1.0, 170.0),
        aperture=st.sampled_from([0.0, 1e-3, 0.05, 0.4, 1.0]),
        focus=st.floats(-2, 5).map(lambda e: 10.0**e),
        down=st.booleans(),
        inside=st.booleans(),
    )
    def tried(seed: int, fov: float, aperture: float, focus: float, down: bool, inside: bool) -> None:
        rng = np.random.default_rng(seed)
        triangles = soup(rng, int(rng.integers(3, 80)), 10.0 ** rng.uniform(-1, 2), at)
        low, high = bounds(triangles)
        within = rng.uniform(-0.2, 1.2, (2, 3)) * (high - low) + low
        eye = corners_of(triangles)[0].mean(axis=0) if inside else within[0]
        target = eye - (0.0, 1.0, 0.0) if down else within[1]
        camera = look_at(tuple(eye), tuple(target), fov_y_deg=fov)
        boxes = scene_boxes(triangles, MATERIALS)
        check(boxes, triangles, camera, Lens(aperture=aperture, focus_distance=focus), near_plane(low, high), rng)

    tried()


def in_some_box(boxes: Boxes, places: np.ndarray, kind: np.ndarray) -> np.ndarray:
    found = np.zeros(len(places), bool)
    for centre, half, bits in zip(boxes.centre, boxes.half, boxes.kinds, strict=True):
        slack = 1e-12 * (1.0 + abs(centre).max())
        found |= (abs(places - centre) <= half + slack).all(axis=1) & (kind & ~int(bits) == 0)
    return found


@pytest.mark.parametrize("name", ["still-life", "toy-train", *(s.name for s in STRESS)])
def test_every_triangle_lies_in_a_box_of_its_kind(name: str, soak: bool) -> None:
    if name == "stress:crowd" and not soak:
        pytest.skip("takes half a minute to make")
    scene, triangles = open_scene(name)
    boxes = scene_boxes(triangles, scene.materials)
    assert len(boxes.centre) <= MOST_BOXES
    assert np.isfinite(boxes.centre).all()
    assert (boxes.half >= 0.0).all()
    standing = np.flatnonzero(triangles.objects[triangles.indices[:, 0]] == 0)
    some = np.random.default_rng(0).permutation(standing)[:4000]
    bits = np.array([ALPHA_MASKED * (m.alpha_cutoff is not None) | NORMAL_MAPPED * (m.normal_texture is not None)
                     for m in scene.materials])  # fmt: skip
    for corner in range(3):
        places = triangles.positions[triangles.indices[some, corner]].astype(np.float64) + triangles.origin
        kinds = bits[triangles.materials[triangles.indices[some, corner]]]
        assert in_some_box(boxes, places, kinds).all()
    for body in triangles.moving:
        assert in_some_box(boxes, np.stack([body.low, body.high]), np.zeros(2, int)).all()


@pytest.mark.parametrize("count", [0, 1, 2, 3, 400])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e9])
def test_scenes_of_any_size(count: int, size: float) -> None:
    rng = np.random.default_rng(count)
    triangles = soup(rng, 3 * count, 1.0, 0.0)
    triangles = replace(triangles, positions=triangles.positions * np.float32(size), indices=triangles.indices[:count])
    boxes = scene_boxes(triangles, MATERIALS)
    assert len(boxes.centre) == min(len(triangles.indices), MOST_BOXES)
    seen = sight(boxes, look_at((0.0, 0.0, 4.0 * size), (0.0, 0.0, 0.0)), PINHOLE, SIZE, 1e-9)
    assert seen.nearest == math.inf if not count else 0.0 < seen.nearest < 8.0 * size


def test_equal_triangles_share_a_box() -> None:
    triangles = soup(np.random.default_rng(1), 3, 1.0, 0.0)
    triangles = replace(triangles, indices=np.tile(triangles.indices, (5000, 1)))
    assert len(scene_boxes(triangles, MATERIALS).centre) == 3


def test_a_run_is_of_all_its_triangles_kinds() -> None:
    """One holey triangle after tens of thousands of plain ones beside it shares a box with the last of them."""
    triangles = soup(np.random.default_rng(2), 3, 1.0, 0.0)
    small = triangles.positions.copy()
    small[triangles.indices[:2]] *= np.float32(1e-4)
    order = np.repeat([0, 1, 2], [40_001, 1, 1])
    triangles = replace(triangles, positions=small, indices=triangles.indices[order])
    boxes = scene_boxes(triangles, MATERIALS)
    places, kind = corners_of(triangles)[order == 1][0], np.full(3, ALPHA_MASKED)
    assert in_some_box(boxes, places, kind).all()


def test_a_floor_begins_where_the_picture_does() -> None:
    """Exactly, though its box reaches behind the camera: a bound per box, not per corner."""
    camera = look_at((0.0, 1.5, 0.0), (0.0, 1.5, -1.0), fov_y_deg=40.0)
    floor = single_box((-9.0, 0.0, -9.0), (9.0, 0.0, 9.0))
    begins = 1.5 / math.tan(math.radians(20.0))
    assert sight(floor, camera, PINHOLE, (10**6, 10**6), 0.02).nearest == pytest.approx(begins, rel=2e-5)
    wide = Lens(aperture=0.2, focus_distance=3.0)  # its lowest point looks a tenth of a metre over 3 m steeper down
    slope = math.tan(math.radians(20.0)) + 0.1 / 3.0
    assert sight(floor, camera, wide, (10**6, 10**6), 0.02).nearest == pytest.approx(1.4 / slope, rel=2e-5)


def test_what_is_beside_or_behind_is_not_seen() -> None:
    scene = scene_of(
        [quad((-0.5, -0.5, -5), (1, 0, 0), (0, 1, 0)), quad((9, -1, -2), (2, 0, 0), (0, 2, 0), 1),
         quad((-1, -1, 3), (2, 0, 0), (0, 2, 0), 2)],
        MATERIALS,
    )  # fmt: skip
    boxes = scene_boxes(flatten(scene), MATERIALS)
    ahead, right, back = ((0.0, 0.0, -1.0), (1.0, 0.0, -0.2), (0.0, 0.0, 1.0))
    looks = [sight(boxes, look_at((0, 0, 0), to, fov_y_deg=40.0), PINHOLE, SIZE, 0.02) for to in (ahead, right, back)]
    assert [look.kinds for look in looks] == [0, ALPHA_MASKED, NORMAL_MAPPED]
    assert looks[0].nearest == pytest.approx(5.0, rel=1e-4)
    assert looks[2].nearest == pytest.approx(3.0, rel=1e-4)


def test_a_wall_behind_ones_back_is_not_seen() -> None:
    """Askew to the view, it crosses the lens' plane, and every side of the picture on its own lets it in."""
    wall = single_box((-3.0, -2.0, 0.05), (3.0, 2.0, 0.05))
    camera = look_at((0.0, 0.0, 0.0), (0.3, -0.1, -1.0), fov_y_deg=60.0)
    assert sight(wall, camera, PINHOLE, SIZE, 0.02).nearest == math.inf
    assert sight(wall, camera, Lens(aperture=0.4, focus_distance=2.0), SIZE, 0.02).nearest < 0.1  # the lens reaches it


def test_a_moving_object_is_where_it_may_be_at_any_time() -> None:
    near = [quad((-0.5, -0.5, -5), (1, 0, 0), (0, 1, 0)), quad((-0.5, -0.5, -9), (1, 0, 0), (0, 1, 0), 1)]
    scene = moving(scene_of(near, MATERIALS), 1, slide=[(0, 0, 0), (0, 0, 7), (0, 0, 0)])
    boxes = scene_boxes(flatten(scene), MATERIALS)
    seen = sight(boxes, look_at((0, 0, 0), (0, 0, -1)), PINHOLE, SIZE, 0.02)
    assert seen.kinds == ALPHA_MASKED
    assert 1.9 < seen.nearest <= 2.0  # the sweep's box bounds the way between key frames


def test_one_box_may_hold_anything() -> None:
    seen = sight(single_box((-1, -1, -1), (1, 1, 1)), look_at((0, 0, 0), (0, 0, -1)), PINHOLE, SIZE, 0.02)
    assert (seen.kinds, seen.nearest) == (ANYTHING, 0.02)


def test_an_empty_scene_shows_nothing() -> None:
    boxes = scene_boxes(flatten(Scene((), (), ())), ())
    assert sight(boxes, look_at((0, 0, 0), (0, 0, -1)), PINHOLE, SIZE, 0.02).nearest == math.inf
