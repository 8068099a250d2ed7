"""The camera: orthonormal under any motion, and matrices that agree with the optics to the pixel."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.camera import Camera, Viewpoint, lens_shear, look_at, offset, projection, read_viewpoint, write_viewpoint
from app.errors import UserError
from app.optics import coc_px, coc_scale_px

coordinate = st.floats(-1e4, 1e4)
points = st.tuples(coordinate, coordinate, coordinate)
fovs = st.floats(1.0, 170.0)

Vec3 = tuple[float, float, float]


def camera_between(eye: Vec3, target: Vec3, up: Vec3 = (0.0, 1.0, 0.0), fov: float = 45.0) -> Camera:
    assume(math.dist(eye, target) > 1e-3)
    return look_at(eye, target, up, fov)


def assert_rigid(view: np.ndarray, eye: Vec3, tolerance: float = 1e-12) -> None:
    """A rotation and a translation that takes the eye to the origin."""
    rotation = view[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=tolerance)
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=tolerance)
    reach = 1.0 + float(np.abs(eye).max())
    np.testing.assert_allclose(view @ [*eye, 1.0], [0, 0, 0, 1], atol=tolerance * reach)


# -- where it looks ----------------------------------------------------------------------------------------------------


@given(eye=points, target=points, up=points)
def test_view_is_rigid_and_puts_the_target_straight_ahead(eye: Vec3, target: Vec3, up: Vec3) -> None:
    camera = camera_between(eye, target, up)
    view = camera.view()
    assert_rigid(view, eye)
    distance = math.dist(eye, target)
    np.testing.assert_allclose(view @ [*target, 1.0], [0, 0, -distance, 1], atol=1e-10 * (distance + np.abs(eye).max()))


@given(eye=points, target=points, up=points)
def test_axes_are_the_rows_of_the_view(eye: Vec3, target: Vec3, up: Vec3) -> None:
    camera = camera_between(eye, target, up)
    rows = [camera.right, camera.true_up, tuple(-x for x in camera.forward)]
    np.testing.assert_allclose(camera.view()[:3, :3], rows, atol=1e-11)


@pytest.mark.parametrize("direction", [(0, 1, 0), (0, -1, 0), (1, 0, 0), (0, 0, 1), (1e-9, -1, 0)])
@pytest.mark.parametrize("up", [(0, 1, 0), (0, -5, 0), (0, 0, 0), (1e-300, 0, 0), (1, 0, 0)])
def test_straight_up_and_down_and_useless_ups_are_finite(direction: Vec3, up: Vec3) -> None:
    camera = look_at((1.0, 2.0, 3.0), tuple(np.add((1.0, 2.0, 3.0), direction)), up)
    assert_rigid(camera.view(), camera.eye)
    assert_rigid(camera.turned(0.1, -0.1).view(), camera.eye)


def test_up_is_up_in_the_picture() -> None:
    camera = look_at((0, 0, 5), (0, 0, 0))
    above, right = camera.view() @ [0, 1, 0, 1], camera.view() @ [1, 0, 0, 1]
    np.testing.assert_allclose(above[:3], [0, 1, -5])
    np.testing.assert_allclose(right[:3], [1, 0, -5])


@pytest.mark.parametrize(
    "arguments",
    [
        ((0, 0, 0), (0, 0, 0)),
        ((math.nan, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (0, 0, math.inf)),
        ((1.5e308, 0, 0), (-1.5e308, 0, 0)),
        ((0, 0, 0), (0, 0, 1), (0, 1, 0), 0.0),
        ((0, 0, 0), (0, 0, 1), (0, 1, 0), 180.0),
        ((0, 0, 0), (0, 0, 1), (0, math.nan, 0)),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow")
def test_impossible_cameras_are_refused_in_a_sentence(arguments: tuple[Any, ...]) -> None:
    with pytest.raises(UserError, match="camera"):
        look_at(*arguments)


# -- moving ------------------------------------------------------------------------------------------------------------


def test_many_small_steps_do_not_wear_it_out() -> None:
    camera, steps = look_at((0, 1, 4), (0.3, 0.8, 0)), 20_000
    for i in range(steps // 4):
        camera = camera.turned(1e-3, 1e-3 * math.sin(0.01 * i)).moved(1e-4, 1e-4, -1e-4)
    assert_rigid(camera.view(), camera.eye, tolerance=1e-13)
    assert np.linalg.norm(camera.forward) == pytest.approx(1.0, abs=1e-13)
    assert np.linalg.norm(camera.up) == pytest.approx(1.0, abs=1e-13)


@given(yaw=st.floats(-7, 7), pitch=st.floats(-7, 7), eye=points, target=points)
def test_turning_never_tips_over(yaw: float, pitch: float, eye: Vec3, target: Vec3) -> None:
    turned = camera_between(eye, target).turned(yaw, pitch)
    assert_rigid(turned.view(), eye)
    assert turned.true_up[1] > 0.0
    assert turned.right[1] == pytest.approx(0.0, abs=1e-15)


def test_directions_of_motion() -> None:
    camera = look_at((0, 0, 0), (0, 0, -1))
    assert camera.moved(1, 2, 3).eye == (1, 2, -3)
    assert camera.turned(0.1, 0.0).forward[0] < 0.0, "positive yaw turns left"
    assert camera.turned(0.0, 0.1).forward[1] > 0.0, "positive pitch looks up"


# -- to pixels ---------------------------------------------------------------------------------------------------------


def pixels(clip: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Window coordinates: pixel p covers p to p + 1, its centre is p + 0.5."""
    return (clip[:2] / clip[3] * 0.5 + 0.5) * np.array(size)


@given(
    depth=st.floats(0.02, 1e6),
    x=st.floats(-1, 1),
    y=st.floats(-1, 1),
    fov=fovs,
    w=st.integers(1, 4000),
    h=st.integers(1, 4000),
)
def test_projection_is_a_pinhole(depth: float, x: float, y: float, fov: float, w: int, h: int) -> None:
    matrix, tangent = projection(math.radians(fov), w / h, 0.01), math.tan(math.radians(fov) / 2)
    clip = matrix @ [x * depth * tangent * w / h, y * depth * tangent, -depth, 1.0]
    assert clip[3] == depth
    np.testing.assert_allclose(pixels(clip, (w, h)), [(x + 1) / 2 * w, (y + 1) / 2 * h], atol=1e-12 * max(w, h))


@given(near=st.floats(1e-6, 1.0), factor=st.floats(1.0, 1e12), further=st.floats(1.001, 10.0))
def test_depth_runs_from_the_near_plane_to_infinity(near: float, factor: float, further: float) -> None:
    def ndc_z(depth: float) -> float:
        clip = projection(1.0, 1.5, near) @ [0, 0, -depth, 1]
        return float(clip[2] / clip[3])

    assert ndc_z(near) == pytest.approx(-1.0, abs=1e-12)
    assert ndc_z(near * factor) <= ndc_z(near * factor * further) <= 1.0


@given(
    jx=st.floats(-0.5, 0.5), jy=st.floats(-0.5, 0.5), depth=st.floats(0.1, 1e4), x=st.floats(-1, 1), y=st.floats(-1, 1)
)
def test_jitter_samples_the_pixel_centre_plus_jitter(jx: float, jy: float, depth: float, x: float, y: float) -> None:
    """What the unjittered picture has at p + 0.5 + jitter is drawn at the centre p + 0.5."""
    size = (320, 180)
    project = projection(0.8, size[0] / size[1], 0.01)
    view_point = [x * depth, y * depth, -depth, 1.0]
    plain, jittered = (pixels(m @ view_point, size) for m in (project, offset((jx, jy), size) @ project))
    np.testing.assert_allclose(jittered, plain - [jx, jy], atol=1e-12 * (1.0 + np.abs(plain).max()))


@given(
    u=st.tuples(st.floats(-1, 1), st.floats(-1, 1)), depth=st.floats(0.05, 1e4), focus=st.floats(0.05, 1e4),
    aperture=st.floats(1e-3, 1.0), fov=fovs, x=st.floats(-1, 1), y=st.floats(-1, 1),
)  # fmt: skip
def test_a_sheared_view_moves_each_depth_by_its_circle_of_confusion(
    u: tuple[float, float], depth: float, focus: float, aperture: float, fov: float, x: float, y: float
) -> None:
    """The key identity: rasterising from lens point u displaces depth z by u coc_px(z) pixels, and the focal plane by
    nothing.
    """
    size, fov = (640, 360), math.radians(fov)
    lens_m = (u[0] * aperture / 2, u[1] * aperture / 2)
    sheared = projection(fov, size[0] / size[1], 0.01) @ lens_shear(lens_m, focus)
    straight = projection(fov, size[0] / size[1], 0.01)
    scale = coc_scale_px(aperture, size[1], fov)
    for z, expected in ((depth, np.array(u) * coc_px(depth, scale, 1 / focus)), (focus, np.zeros(2))):
        view_point = [x * z, y * z, -z, 1.0]
        before, after = pixels(straight @ view_point, size), pixels(sheared @ view_point, size)
        cancelled = np.abs(before).max() + scale * (1 / z + 1 / focus) + size[0]
        np.testing.assert_allclose(after - before, expected, atol=4e-15 * cancelled)


def test_the_shear_puts_the_lens_point_at_the_centre_of_projection() -> None:
    np.testing.assert_allclose(lens_shear((0.1, -0.2), 3.0) @ [0.1, -0.2, 0.0, 1.0], [0, 0, 0, 1])


# -- camera files ------------------------------------------------------------------------------------------------------


@given(
    eye=points,
    target=points,
    up=points,
    fov=fovs,
    focus=st.none() | st.floats(1e-3, 1e6),
    aperture=st.none() | st.floats(0, 1),
)
def test_a_camera_file_reads_back(
    tmp_path_factory: pytest.TempPathFactory,
    eye: Vec3,
    target: Vec3,
    up: Vec3,
    fov: float,
    focus: float | None,
    aperture: float | None,
) -> None:
    camera = camera_between(eye, target, up, fov)
    path = tmp_path_factory.getbasetemp() / "kept.json"
    write_viewpoint(path, Viewpoint(camera, focus, aperture))
    again = read_viewpoint(path)
    assert (again.focus_distance, again.aperture, again.name) == (focus, aperture, "kept")
    assert again.camera.eye == camera.eye
    np.testing.assert_allclose(again.camera.view()[:3, :3], camera.view()[:3, :3], atol=1e-10)
    assert again.camera.fov_y == pytest.approx(camera.fov_y, rel=1e-15)


PLACED = '{"eye": [0,0,0], "target": [0,0,1], '
BAD_FILES = {
    "no JSON": ["", "{", pytest.param("[" * 100_000, id="nested")],
    "no object": ["[]", "3", "null", '"eye"'],
    "no place": [
        "{}",
        '{"eye": [0,0,0]}',
        '{"eye": [0,0], "target": [0,0,1]}',
        '{"eye": [0,0,0], "target": [0,0,0]}',
        '{"eye": ["a",0,0], "target": [0,0,1]}',
        '{"eye": null, "target": [0,0,1]}',
        '{"eye": "123", "target": [0,0,1]}',
        '{"eye": [NaN,0,0], "target": [0,0,1]}',
        '{"eye": [0,0,0], "target": [0,0,1e400]}',
        pytest.param('{"eye": [0,0,0], "target": [0,0,1' + "0" * 400 + "]}", id="400 digits"),
    ],
    "no view": [PLACED + text for text in ('"up": [1,2]}', '"fov_y_deg": "wide"}', '"fov_y_deg": 360}')],
    "no lens": [
        PLACED + f'"{name}": {value}}}'
        for name, value in (
            ("focus_distance", 0),
            ("focus_distance", -2),
            ("focus_distance", "Infinity"),
            ("aperture", -0.1),
            ("aperture", "NaN"),
            ("aperture", [1]),
        )
    ],
}


@pytest.mark.parametrize("text", [text for texts in BAD_FILES.values() for text in texts])
def test_a_bad_camera_file_is_one_sentence_that_names_it(text: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.json"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        read_viewpoint(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_or_binary_camera_file_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00glTF")
    for path in (tmp_path / "missing.json", tmp_path, tmp_path / "binary.json"):
        with pytest.raises(UserError) as caught:
            read_viewpoint(path)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_what_a_camera_file_may_leave_out(tmp_path: Path) -> None:
    path = tmp_path / "short.json"
    path.write_text(json.dumps({"eye": [0, 0, 0], "target": [0, 0, -1], "focus_distance": None}))
    view = read_viewpoint(path)
    assert (view.focus_distance, view.aperture) == (None, None)
    assert view.camera.up == (0, 1, 0)


def test_a_camera_file_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"nowhere"):
        write_viewpoint(tmp_path / "nowhere" / "camera.json", Viewpoint(Camera()))
