"""The camera at its worst: every finite number in, and out comes a rigid view or one sentence."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from app.camera import (
    FARTHEST_M,
    FOV_Y_DEG,
    Camera,
    Viewpoint,
    look_at,
    offset,
    projection,
    read_viewpoint,
    write_viewpoint,
)
from app.controls import FAST, MAX_STEPS, SPEED_RANGE, STEP_S, Pilot, fly
from app.errors import UserError
from app.optics import SKY_DEPTH, coc_scale_px

EPS = 2.0**-52
Vec3 = tuple[float, float, float]

anything = st.floats(allow_nan=True, allow_infinity=True)  # denormals, the largest numbers and both zeros among them
finite = st.floats(allow_nan=False, allow_infinity=False)
places = st.floats(-FARTHEST_M, FARTHEST_M)
directions = st.tuples(*[st.floats(-1, 1)] * 3)


def assert_rigid(camera: Camera, ulps: float = 8.0) -> None:
    """Orthonormal, right-handed, along `forward`, and with the eye at the origin, each to a few roundings.

    A normalised cross product has an error of some 4 roundings, a scalar product of two such rows adds 3 more; where
    the eye lands, three products of its coordinates with the rows' rounding cancel.
    """
    view = camera.view()
    rotation = view[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=ulps * EPS)
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=ulps * EPS)
    np.testing.assert_allclose(-rotation[2], camera.forward, atol=ulps * EPS)
    reach = max(1.0, *(abs(x) for x in camera.eye))
    np.testing.assert_allclose(view @ [*camera.eye, 1.0], [0, 0, 0, 1], atol=ulps * EPS * reach)


def sentence(eye: Vec3, target: Vec3, up: Vec3, fov: float) -> str | None:
    """What a user is told of such a camera; None where it can be used."""
    try:
        look_at(eye, target, up, fov)
    except UserError as error:
        return str(error)
    return None


# -- any numbers -------------------------------------------------------------------------------------------------------


@given(eye=st.tuples(*[anything] * 3), target=st.tuples(*[anything] * 3), up=st.tuples(*[anything] * 3), fov=anything)
@example(eye=(1e17, 0.0, 0.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fov=45.0)
@example(eye=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1.0), up=(1e300, 1e300, 0.0), fov=45.0)
@example(eye=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1.0), up=(0.0, 5e-324, 0.0), fov=45.0)
@example(eye=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1e308), up=(0.0, 1.0, 0.0), fov=5e-324)
@pytest.mark.filterwarnings("ignore:overflow")
def test_numbers_of_any_size_are_a_rigid_view_or_a_sentence(eye: Vec3, target: Vec3, up: Vec3, fov: float) -> None:
    refused = sentence(eye, target, up, fov)
    if refused is not None:
        assert "camera" in refused
        assert "\n" not in refused
        return
    camera = look_at(eye, target, up, fov)
    assert_rigid(camera)
    assert max(map(abs, camera.eye)) <= FARTHEST_M
    assert np.linalg.norm(camera.up) == pytest.approx(1.0, abs=4 * EPS)
    lens = coc_scale_px(1.0, 16384, camera.fov_y), *projection(camera.fov_y, 16384.0, 1e-9).ravel()
    assert np.isfinite(np.array(lens, np.float32)).all()


@given(eye=st.tuples(*[places] * 3), away=directions, up=directions)
def test_the_view_is_as_exact_far_from_the_origin_as_near_it(eye: Vec3, away: Vec3, up: Vec3) -> None:
    """A view made from two places, as pyrr's is, would lose as many digits of the direction as the eye has."""
    assume(math.hypot(*away) > 1e-3)
    near = look_at((0.0, 0.0, 0.0), away, up)
    far = Camera(eye, near.forward, near.up)
    assert_rigid(far)
    np.testing.assert_array_equal(far.view()[:3, :3], near.view()[:3, :3])


@given(eye=st.tuples(*[places] * 3), away=directions, fov=st.floats(*FOV_Y_DEG))
def test_a_camera_file_keeps_the_direction_however_far_out(
    tmp_path_factory: pytest.TempPathFactory, eye: Vec3, away: Vec3, fov: float
) -> None:
    """eye + forward would round the direction away: from 1e16 m on, all of it, and the file could not be read."""
    assume(math.hypot(*away) > 1e-3)
    camera = Camera(eye, look_at((0.0, 0.0, 0.0), away).forward, fov_y=math.radians(fov))
    path = tmp_path_factory.getbasetemp() / "far.json"
    write_viewpoint(path, Viewpoint(camera))
    again = read_viewpoint(path).camera
    assert again.eye == camera.eye
    np.testing.assert_allclose(again.forward, camera.forward, atol=8 * EPS)


@pytest.mark.parametrize("fov", [0.0, -1.0, 5e-324, 0.09, 179.1, 180.0, 1e308, math.nan, math.inf])
def test_a_field_of_view_that_no_picture_has_is_refused(fov: float) -> None:
    with pytest.raises(UserError, match=r"field of view|not finite"):
        look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), fov_y_deg=fov)


# -- straight up and down ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [2.0, 0.5, 0.01, 1e-4])
@pytest.mark.parametrize("vertical", [-1.0, 1.0])
def test_an_up_that_says_something_is_heeded_to_the_last(degrees: float, vertical: float) -> None:
    """Close to straight up or down the world's up still tells which way the picture is turned."""
    angle = math.radians(degrees)
    camera = look_at((0.0, 0.0, 0.0), (math.sin(angle), vertical * math.cos(angle), 0.0))
    np.testing.assert_allclose(camera.right, (0.0, 0.0, 1.0), atol=1e-9)
    assert_rigid(camera)


@pytest.mark.parametrize("length", [5e-324, 1e-300, 1e-160, 1.0, 1e160, 1e308])
def test_an_up_of_any_length_is_the_same_up(length: float) -> None:
    """Its square may overflow or vanish; its direction says which way is up all the same."""
    camera = look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (length, length, 0.0))
    np.testing.assert_allclose(camera.up, (math.sqrt(0.5), math.sqrt(0.5), 0.0), atol=2 * EPS)


@given(heading=st.floats(-math.pi, math.pi), vertical=st.sampled_from([-1.0, 1.0]), yaw=st.floats(-3.0, 3.0))
def test_turning_away_from_straight_down_goes_on_from_what_is_seen(heading: float, vertical: float, yaw: float) -> None:
    """Looking straight up or down, the heading is the picture's: the first touch of the mouse must not spin it."""
    ahead = np.array([-math.sin(heading), 0.0, -math.cos(heading)])  # upwards in a picture of the ground
    camera = look_at((0.0, 0.0, 0.0), (0.0, vertical, 0.0), tuple(-vertical * ahead))
    turned = camera.turned(yaw, 0.0)
    assert_rigid(turned)
    spin = math.acos(min(float(np.dot(turned.right, camera.right)), 1.0))
    assert spin == pytest.approx(abs(yaw), abs=1e-7)
    assert np.dot(turned.forward, camera.forward) > math.cos(math.radians(1.001))


# -- motion ------------------------------------------------------------------------------------------------------------


def test_a_million_small_turns_neither_bend_nor_drift(soak: bool) -> None:
    """10^6 turns by small angles of either sign, undone in the opposite order.

    Each turn rounds azimuth and elevation by an ulp of pi and recovers the elevation by an arcsine, whose error the
    cosine, above 0.3 here, divides: below 16 roundings a turn, which add up as steps of a random walk.
    """
    count = 1_000_000 if soak else 20_000
    rng = np.random.default_rng(3)
    half = rng.normal(scale=1e-3, size=(count // 2, 2))
    half[:, 1] = np.diff(np.sin(np.linspace(0.0, 300.0, count // 2 + 1)))  # up and down between +-1 rad
    start = camera = look_at((0.0, 1.0, 4.0), (0.3, 0.8, 0.0))
    for i, (yaw, pitch) in enumerate(np.concatenate([half, -half[::-1]]).tolist()):
        camera = camera.turned(yaw, pitch)
        if i % (count // 20) == 0:
            assert_rigid(camera)
    assert_rigid(camera)
    np.testing.assert_allclose(camera.forward, start.forward, atol=16 * EPS * math.sqrt(count))
    assert camera.eye == start.eye


@given(st.tuples(*[st.floats(-1e6, 1e6)] * 3), directions, st.floats(-FARTHEST_M, FARTHEST_M))
def test_no_flight_leaves_the_world(eye: Vec3, away: Vec3, far: float) -> None:
    assume(math.hypot(*away) > 1e-3)
    camera = look_at(eye, tuple(np.add(eye, away)))
    for move in ((far, 0.0, 0.0), (0.0, far, 0.0), (0.0, 0.0, far)):
        for _ in range(2):
            camera = camera.moved(*move)
        assert_rigid(camera)
        assert max(map(abs, camera.eye)) <= FARTHEST_M


@given(st.tuples(*[places] * 3), st.floats(-1e-300, 1e-300))
def test_moves_of_no_length_change_nothing(eye: Vec3, tiny: float) -> None:
    assume(min(map(abs, eye)) > 1e-200)
    camera = Camera(eye)
    assert camera.moved(0.0, 0.0, 0.0) == camera.moved(tiny, -tiny, tiny) == camera
    assert fly(camera, {"w", "d", "e"}, (0.0, 0.0), 1.0, 0.0) == camera


@given(yaw=finite, pitch=finite, eye=st.tuples(*[places] * 3))
def test_a_turn_of_any_size_is_a_turn(yaw: float, pitch: float, eye: Vec3) -> None:
    turned = Camera(eye).turned(yaw, pitch)
    assert_rigid(turned)
    assert turned.true_up[1] > 0.0


@given(elapsed=st.floats(0.0, 1e300), speed=st.floats(*SPEED_RANGE), mouse=st.tuples(finite, finite))
def test_a_stall_of_any_length_costs_a_second_of_flight_at_most(
    elapsed: float, speed: float, mouse: tuple[float, float]
) -> None:
    pilot, camera = Pilot(speed=speed), Camera()
    pilot.press("w")
    pilot.press("lshift")
    pilot.look(*mouse)
    flown = pilot.advance(pilot.advance(camera, elapsed), 0.0)
    assert_rigid(flown)
    most = FAST * speed * (MAX_STEPS + 1) * STEP_S
    assert math.dist(flown.eye, camera.eye) <= most * (1.0 + 1e-9)


def test_no_time_is_no_flight() -> None:
    pilot = Pilot()
    pilot.press("w")
    assert all(pilot.advance(Camera(), 0.0) == Camera() for _ in range(100))


# -- to pixels ---------------------------------------------------------------------------------------------------------


@given(fov=st.floats(*FOV_Y_DEG), near=st.floats(1e-9, 0.02), far=st.floats(1.0, SKY_DEPTH), slope=st.floats(-1, 1))
def test_depths_from_a_nanometre_to_the_sky_survive_float32(fov: float, near: float, far: float, slope: float) -> None:
    """What the GPU gets: a pixel's place at any depth within a few float32 roundings, and no depth beyond the planes.

    One rounding of the matrix entry, one of the product, one of the quotient by w, which is the depth itself.
    """
    matrix, tangent = projection(math.radians(fov), 1.5, near).astype(np.float32), math.tan(math.radians(fov) / 2)
    for depth in np.array([near, far], np.float32):
        point = np.array([slope * tangent * depth * 1.5, slope * tangent * depth, -depth, 1.0], np.float32)
        clip = matrix @ point
        np.testing.assert_allclose(clip[:2] / clip[3], slope, atol=4 * 2.0**-23)
        assert clip[3] == depth
        assert -1.0 - 4 * 2.0**-23 <= clip[2] / clip[3] <= 1.0


@given(st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)), st.integers(1, 16384), st.integers(1, 16384))
def test_jitter_moves_by_itself_at_any_size(jitter: tuple[float, float], width: int, height: int) -> None:
    shift = offset(jitter, (width, height)) @ [0.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(shift[:2] * [width / 2, height / 2], np.negative(jitter), rtol=4 * EPS, atol=1e-300)


def test_a_camera_file_with_not_a_number_anywhere_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "odd.json"
    good = {"eye": "[0, 1, 4]", "target": "[0, 0, 0]", "up": "[0, 1, 0]", "fov_y_deg": "45"}
    good |= {"focus_distance": "2", "aperture": "0.1"}
    bad = ("NaN", "Infinity", "-Infinity", "[NaN, 0, 0]", "[0, Infinity, 0]", "1e999", "[1e999, 0, 0]", "{}", "[[]]")
    for key in good:
        for value in bad:
            path.write_text("{" + ", ".join(f'"{k}": {v}' for k, v in {**good, key: value}.items()) + "}")
            with pytest.raises(UserError) as caught:
                read_viewpoint(path)
            assert str(path) in str(caught.value)
            assert "\n" not in str(caught.value)
