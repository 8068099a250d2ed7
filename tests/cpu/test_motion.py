"""Motion against closed forms; a glTF animation moves what it says, and boxes hold all that it passes through."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.scene.facts import scene_facts
from app.scene.flatten import bounds, flatten, places, triangles_of
from app.scene.model import Instance, Material, Mesh, Scene
from app.scene.motion import Joint, Motion, Track, rotation_matrices, still, unit_quaternions

IDENTITY = [0.0, 0.0, 0.0, 1.0]


def spin(axis: int, degrees: float) -> list[float]:
    half = math.radians(degrees) / 2
    q = [0.0, 0.0, 0.0, math.cos(half)]
    q[axis] = math.sin(half)
    return q


def rotation(axis: int, degrees: float) -> np.ndarray:
    """Rotation matrix about a coordinate axis, by its textbook entries."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def turn(degrees: tuple[float, ...]) -> Track:
    """About z, through evenly spaced keys in two seconds."""
    return Track(np.linspace(0.0, 2.0, len(degrees)), unit_quaternions([spin(2, a) for a in degrees]))


# -- tracks and chains -------------------------------------------------------------------------------------------------


def test_positions_run_straight_and_are_held_at_the_ends() -> None:
    track = Track(np.array([1.0, 3.0]), np.array([[0, 0, 0], [4, -2, 1.0]]))
    got = track.at(np.array([0.0, 1.0, 2.0, 3.0, 9.0]))
    np.testing.assert_allclose(got, [[0, 0, 0], [0, 0, 0], [2, -1, 0.5], [4, -2, 1], [4, -2, 1]], atol=1e-15)
    travel = track.travel(np.array([0.5, 2.0, 3.5]), np.array([0.6, 2.5, 4.0]))
    np.testing.assert_allclose(travel, [0, math.hypot(4, -2, 1) / 4, 0])


def test_steps_keep_each_value_until_the_next_key() -> None:
    track = Track(np.array([0.0, 1.0, 1.0, 2.0]), np.arange(12.0).reshape(4, 3), step=True)
    np.testing.assert_array_equal(track.at(np.array([0.99, 1.0, 1.99, 2.0]))[:, 0], [0, 6, 6, 9])
    assert (track.travel(np.linspace(0, 1.75, 8), np.linspace(0.25, 2, 8)) == 0).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("degrees", [1e-7, 0.3, 90.0, 179.0])
def test_turns_have_constant_speed(axis: int, degrees: float) -> None:
    track = Track(np.array([0.0, 2.0]), unit_quaternions([IDENTITY, spin(axis, degrees)]))
    for share in (0.0, 0.25, 0.5, 1.0):
        got = rotation_matrices(track.at(np.array([2 * share])))[0]
        np.testing.assert_allclose(got, rotation(axis, degrees * share), atol=1e-12)
    travel = track.travel(np.array([0.5]), np.array([1.0]))
    np.testing.assert_allclose(travel, math.radians(degrees) / 4, rtol=1e-9)


def test_quaternions_take_the_shorter_arc_and_any_length() -> None:
    q = unit_quaternions([IDENTITY, np.multiply(spin(1, 60), -3e200), np.zeros(4), np.multiply(spin(1, 90), 1e-200)])
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0)
    np.testing.assert_allclose(q[1], spin(1, 60), atol=1e-15)
    np.testing.assert_allclose(np.abs(q[2]), IDENTITY)


def test_a_chain_is_the_product_of_its_joints() -> None:
    """A moon on an arm that turns on a cart that slides: 90 degrees after the cart's first metre."""
    base = np.eye(4)
    base[:3, 3] = (0, 5, 0)
    cart = Joint(
        base, Track(np.array([0.0, 2.0]), np.array([[0, 0, 0], [2, 0, 0.0]])), still(IDENTITY), np.full(3, 2.0)
    )
    arm = Joint(np.eye(4), still((0, 1, 0)), turn((0, 180)), np.ones(3))
    motion = Motion((cart, arm), 2.0)
    place = motion.placed(1.0)[0]
    np.testing.assert_allclose(place @ [1, 0, 0, 1], [1, 5 + 2 * (1 + 1), 0, 1], atol=1e-12)
    moved = motion.displacement(1.0) @ [2, 7, 0, 1]  # the same point, where the world had it at time 0
    np.testing.assert_allclose(moved, [1, 9, 0, 1], atol=1e-12)
    np.testing.assert_allclose(motion.displacement(0.0), np.eye(4), atol=1e-15)
    for time_s in (-3.0, 5.0, 2001.0):
        np.testing.assert_allclose(motion.displacement(time_s), motion.displacement(1.0), atol=1e-12)
    linear = motion.displacement(0.7)[:3, :3]  # the scale cancels: what moves is rigid
    np.testing.assert_allclose(linear @ linear.T, np.eye(3), atol=1e-12)


vectors = st.lists(st.floats(-5, 5), min_size=3, max_size=3)
quaternions = st.lists(st.floats(-1, 1), min_size=4, max_size=4)


@st.composite
def tracks(draw: st.DrawFn, values: st.SearchStrategy[list[float]], turn: bool) -> Track:
    keys = draw(st.lists(values, min_size=1, max_size=4))
    times = np.sort(draw(st.lists(st.floats(0, 3), min_size=len(keys), max_size=len(keys))))
    array = unit_quaternions(keys) if turn else np.array(keys, float)
    return Track(times, array, draw(st.booleans()))


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    joints = []
    for _ in range(draw(st.integers(1, 3))):
        base = np.eye(4)
        base[:3, :3] = rotation_matrices(unit_quaternions([draw(quaternions)]))[0] * draw(st.floats(0.2, 2))
        base[:3, 3] = draw(vectors)
        scale = np.array(draw(st.lists(st.floats(0.3, 2), min_size=3, max_size=3)))
        joints.append(Joint(base, draw(tracks(vectors, False)), draw(tracks(quaternions, True)), scale))
    return Motion(tuple(joints), 3.0)


@settings(max_examples=150, deadline=None)
@given(motion=motions(), low=vectors, time=st.floats(0, 3), seed=st.integers(0, 999))
def test_the_swept_box_holds_every_point_at_every_time(
    motion: Motion, low: list[float], time: float, seed: int
) -> None:
    box = np.array(low), np.array(low) + np.random.default_rng(seed).uniform(0, 3, 3)
    lowest, highest = motion.swept(*box)
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(*box, (20, 3)), np.ones(20)])
    times = [time, *(k + e for t in motion.joints[0].rotation.times for k in [t] for e in (0, 1e-9, -1e-9))]
    slack = 1e-9 * (1 + np.abs([lowest, highest]).max())
    for moment in times:
        moved = (points @ motion.displacement(min(max(moment, 0.0), 2.999999)).T)[:, :3]
        assert (moved >= lowest - slack).all()
        assert (moved <= highest + slack).all()


def test_the_swept_box_of_a_turn_is_nearly_its_circle() -> None:
    """Conservative, but not wasteful: within the pad of 256 samples."""
    wheel = Joint(np.eye(4), still((0, 0, 0)), turn((0, 120, 240, 360)), np.ones(3))
    low, high = Motion((wheel,), 2.0).swept(np.array([0.0, 0, 0]), np.array([1.0, 0, 0]))
    pad = math.pi / 256
    np.testing.assert_allclose(low, [-1, -1, 0], atol=1.01 * pad)
    np.testing.assert_allclose(high, [1, 1, 0], atol=1.01 * pad)
    assert low[0] <= -1.0
    assert high[1] >= 1.0


# -- the scene ---------------------------------------------------------------------------------------------------------


def test_what_shares_a_motion_is_one_object_in_its_own_space() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    normals, tangents = np.tile([0, 0, 1], (3, 1)).astype(np.float32), np.zeros((3, 4), np.float32)
    mesh = Mesh(corners, normals, corners[:, :2], tangents, np.array([[0, 1, 2]], np.uint32), 0)
    along = Track(np.array([0.0, 1.0]), np.array([[0, 0, 0], [8, 0, 0.0]]))
    slide = Motion((Joint(np.eye(4), along, still(IDENTITY), np.ones(3)),), 1.0)
    there = np.eye(4)
    there[:3, 3] = (100, 0, 0)
    both = [Instance(0, there, "a", slide), Instance(0, np.eye(4)), Instance(0, there @ there, "b", slide)]
    flat = flatten(Scene((mesh,), (Material(),), tuple(both)))
    assert flat.objects.tolist() == [0] * 3 + [1] * 6
    assert triangles_of(flat) == [2]
    (moving,) = flat.moving
    np.testing.assert_allclose(moving.origin, [150.5, 0.5, 0])
    np.testing.assert_allclose(moving.half_size, [50.5, 0.5, 0])
    np.testing.assert_allclose(flat.positions[3:6], corners - [50.5, 0.5, 0])
    np.testing.assert_allclose(places([moving], 0.25)[0] @ [0, 0, 0, 1], [152.5, 0.5, 0, 1])
    low, high = bounds(flat)
    np.testing.assert_allclose(low, 0, atol=8 / 512)  # half a step of the sweep
    np.testing.assert_allclose(high, [209, 1, 0], atol=8 / 512)
    assert scene_facts(Scene((mesh,), (Material(),), tuple(both)), low, high).objects
    assert not scene_facts(Scene((mesh,), (Material(),), (both[1],)), low, high).objects
