"""The fly camera and the key table, without a window."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.camera import Camera, look_at
from app.controls import (
    ACTIONS,
    BINDINGS,
    FAST,
    LOOK_RAD_PER_PX,
    MAX_STEPS,
    SLOW,
    SPEED_RANGE,
    STEP_S,
    Pilot,
    fly,
    wheel_speed,
)
from app.frame.pipeline import VIEWS

STILL = (0.0, 0.0)
KEYS = st.frozensets(st.sampled_from(["w", "a", "s", "d", "q", "e", "lshift", "lctrl"]))


def moved(keys: set[str], camera: Camera = Camera(), speed: float = 2.0, dt: float = 0.5) -> np.ndarray:  # noqa: B008  frozen
    return np.subtract(fly(camera, keys, STILL, speed, dt).eye, camera.eye)


@pytest.mark.parametrize(
    ("key", "direction"),
    [("w", (0, 0, -1)), ("s", (0, 0, 1)), ("a", (-1, 0, 0)), ("d", (1, 0, 0)), ("e", (0, 1, 0)), ("q", (0, -1, 0))],
)
def test_each_key_flies_its_way_at_the_given_speed(key: str, direction: tuple[int, int, int]) -> None:
    np.testing.assert_allclose(moved({key}), direction, atol=1e-12)


def test_forward_follows_the_view_and_up_the_world() -> None:
    camera = look_at((1, 2, 3), (4, 6, -2))
    np.testing.assert_allclose(moved({"w"}, camera), camera.forward, atol=1e-12)
    np.testing.assert_allclose(moved({"e"}, camera), (0, 1, 0), atol=1e-12)


def test_opposite_keys_cancel_and_unknown_keys_do_nothing() -> None:
    assert fly(Camera(), {"w", "s", "a", "d"}, STILL, 1.0, 1.0) == Camera()
    assert fly(Camera(), {"x", "_9"}, STILL, 1.0, 1.0) == Camera()


@given(KEYS)
def test_no_combination_is_faster_than_its_modifiers_allow(keys: frozenset[str]) -> None:
    factor = (FAST if "lshift" in keys else 1.0) * (SLOW if "lctrl" in keys else 1.0)
    length = np.linalg.norm(moved(set(keys)))
    assert length == pytest.approx(factor, rel=1e-12) or length == 0.0


def test_either_shift_and_either_ctrl_count() -> None:
    assert np.array_equal(moved({"w", "lshift"}), moved({"w", "rshift"}))
    assert np.array_equal(moved({"w", "lctrl"}), moved({"w", "rctrl"}))


def test_the_mouse_turns_right_and_down_as_it_moves() -> None:
    level = Camera()
    assert fly(level, (), (100.0, 0.0), 1.0, STEP_S).forward[0] == pytest.approx(math.sin(100 * LOOK_RAD_PER_PX))
    assert fly(level, (), (0.0, 100.0), 1.0, STEP_S).forward[1] == pytest.approx(-math.sin(100 * LOOK_RAD_PER_PX))


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
def test_no_mouse_motion_breaks_the_camera(dx: float, dy: float) -> None:
    camera = fly(Camera(), (), (dx, dy), 1.0, STEP_S)
    assert np.linalg.norm(camera.forward) == pytest.approx(1.0)
    assert np.isfinite(camera.view()).all()


@given(st.lists(st.floats(0.001, 0.2), min_size=1, max_size=30))
def test_the_same_flight_whatever_the_frames_take(frames: list[float]) -> None:
    """Any split of the same time into frames simulates the same whole steps: the path is equal to the last bit."""
    total = sum(frames)
    pilot, camera = Pilot(), Camera()
    pilot.press("w")
    for elapsed in frames:
        camera = pilot.advance(camera, elapsed)
    steps = round(-camera.eye[2] + 4.0, 12) / STEP_S
    assert steps == pytest.approx(round(steps), abs=1e-6)
    assert abs(steps - total / STEP_S) <= 1.0 + 1e-6
    reference = Camera()
    for _ in range(round(steps)):
        reference = fly(reference, {"w"}, STILL, 1.0, STEP_S)
    assert camera == reference


def test_a_tap_within_one_slow_frame_still_moves() -> None:
    pilot = Pilot()
    pilot.press("w")
    pilot.release("w")
    assert pilot.active
    camera = pilot.advance(Camera(), 0.5)
    assert camera.eye[2] == pytest.approx(4.0 - STEP_S)
    assert not pilot.active


def test_mouse_motion_is_spent_once() -> None:
    pilot = Pilot()
    pilot.look(30.0, 0.0)
    pilot.look(70.0, 0.0)
    camera = pilot.advance(Camera(), 10 * STEP_S)
    assert camera.forward[0] == pytest.approx(math.sin(100 * LOOK_RAD_PER_PX))
    assert pilot.advance(camera, 1.0) == camera


def test_a_stall_is_not_flown_through() -> None:
    pilot = Pilot()
    pilot.press("w")
    camera = pilot.advance(Camera(), 1000.0)
    assert camera.eye[2] == pytest.approx(4.0 - MAX_STEPS * STEP_S)
    assert pilot.advance(camera, 0.0).eye[2] >= camera.eye[2] - 1.001 * STEP_S


def test_losing_the_keyboard_lets_go_of_everything() -> None:
    pilot = Pilot()
    pilot.press("w")
    pilot.press("lshift")
    pilot.let_go()
    assert pilot.advance(Camera(), 1.0) == Camera()


def test_a_still_camera_stays_equal_so_that_samples_accumulate() -> None:
    camera = replace(Camera(), eye=(0.1, 0.2, 0.3))
    assert Pilot().advance(camera, 0.3) == camera


@given(st.floats(-1e3, 1e3))
def test_the_wheel_keeps_the_speed_usable(notches: float) -> None:
    assert SPEED_RANGE[0] <= wheel_speed(1.0, notches) <= SPEED_RANGE[1]


def test_the_wheel_doubles_the_speed_in_four_notches_and_goes_back() -> None:
    assert wheel_speed(1.0, 4.0) == pytest.approx(2.0, rel=0.05)
    assert wheel_speed(wheel_speed(3.0, 5.0), -5.0) == pytest.approx(3.0)


def test_no_key_means_two_things() -> None:
    keys = [key for binding in BINDINGS for key in binding.keys]
    assert len(keys) == len(set(keys)) == len(ACTIONS)


def test_every_view_has_a_key_and_every_binding_explains_itself() -> None:
    assert {f"view {view}" for view in VIEWS} <= set(ACTIONS.values())
    assert all(binding.label and binding.meaning for binding in BINDINGS)
