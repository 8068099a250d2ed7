"""The stress scenes as they load: each has the hard case that it is named after, and all are found by name."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from app.bench_options import subjects_of
from app.cli import main
from app.errors import BAD_INPUT, UserError
from app.measure.store import scene_digest
from app.optics import coc_px, coc_scale_px
from app.scene.facts import near_plane
from app.scene.flatten import bounds, flatten
from app.scene.load import load_scene, scene_file
from app.scene.model import Scene
from app.scene.stress import crowd, hedge, slivers, table
from app.scene.stress.catalogue import PREFIX, STRESS, stress_scene

NAMES = [entry.name for entry in STRESS]
LIGHT = [name for name in NAMES if name != "stress:crowd"]


def corners(scene: Scene) -> np.ndarray:
    """(m, 3, 3) of the triangles in the world, float64."""
    flat = flatten(scene)
    return flat.positions.astype(np.float64)[flat.indices]


@pytest.mark.parametrize("name", LIGHT)
def test_a_stress_scene_loads_with_a_camera_and_is_the_same_each_time(name: str) -> None:
    scene, again = load_scene(name), load_scene(name)
    assert scene.report.source == name
    (camera,) = scene.cameras
    assert camera.focus_distance is not None
    assert camera.aperture is not None
    assert scene_digest(scene) == scene_digest(again)
    assert flatten(scene).positions.tobytes() == flatten(again).positions.tobytes()


def test_the_list_names_them_in_their_own_group(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenes"]) == 0
    own, _, stress = capsys.readouterr().out.partition("\n\n")
    assert PREFIX not in own
    for entry in STRESS:
        assert f"{entry.name} " in stress
        assert entry.description in stress
    assert len(set(NAMES)) == len(NAMES)


@pytest.mark.parametrize("command", ["plan", "info"])
def test_a_stress_scene_is_a_scene_to_commands(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("stress:empty", "stress:knife-edges"):
        assert main([command, name]) == 0
        assert name in capsys.readouterr().out
    (subject,) = subjects_of(["stress:hedge"])
    assert subject.scene == "stress:hedge"
    assert scene_file("stress:hedge").name == "hedge.py", "what a benchmark knows it by"


@pytest.mark.parametrize("name", ["stress:", "stress:nothing", "stress:Hedge", "stress:still-life"])
def test_an_unknown_one_is_a_sentence_with_all_names(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", name]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert all(known in line for known in NAMES)
    with pytest.raises(UserError, match="no stress scene"):
        stress_scene(name)
    assert stress_scene("still-life") is None


def test_shells_are_closed() -> None:
    """Every edge belongs to two triangles, once in each direction."""
    for mesh in load_scene("stress:watertight").meshes:
        _, welded = np.unique(mesh.positions, axis=0, return_inverse=True)
        a, b, c = welded.ravel()[mesh.triangles].T
        edges = np.sort(np.concatenate([np.stack(pair, 1) for pair in ((a, b), (b, c), (c, a))]), axis=1)
        _, uses = np.unique(edges, axis=0, return_counts=True)
        assert (uses == 2).all()


def test_slivers_are_as_thin_as_said_and_some_triangles_have_no_area() -> None:
    scene = load_scene("stress:slivers")
    assert scene.report.degenerate == len(slivers.WALLS) * slivers.COLUMNS
    points = corners(scene)
    sides = np.linalg.norm(points - np.roll(points, 1, axis=1), axis=2)
    area = 0.5 * np.linalg.norm(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1)
    aspect = sides.max(axis=1) ** 2 / (2 * area)  # longest side to the height above it
    assert np.count_nonzero(aspect > 1e6) == len(slivers.WALLS) * slivers.COLUMNS
    assert aspect.max() < 1e8


def test_duplicates_are_exact_and_neighbours_one_step_apart() -> None:
    points = corners(load_scene("stress:coplanar"))
    copies = Counter(frozenset(map(tuple, triangle)) for triangle in points)
    assert [count for count in copies.values() if count > 1] == [2] * 6, "two triangles of a square at three distances"
    squares = sorted({float(z) for z in points[:, 0, 2] if -2.6 < z < -2.4})
    assert squares == [-2.5, float(np.nextafter(np.float32(-2.5), np.float32(0.0)))]


def test_scaled_and_moved_ones_are_the_same_scene() -> None:
    twin = bounds(flatten(load_scene("stress:twin")))
    for name, scale, origin in (("tiny", 1e-3, 0.0), ("huge", 1e4, 0.0), ("far-away", 1.0, 1e5)):
        low, high = bounds(flatten(load_scene(PREFIX + name)))
        step = np.spacing(np.float32(origin + 6 * scale))
        for corner, there in zip(twin, (low, high), strict=True):
            np.testing.assert_allclose(there - [origin, 0, -origin], scale * corner, atol=2 * float(step))
    assert load_scene("stress:tiny").cameras[0].focus_distance == table.FOCUS * 1e-3


def test_a_crowd_is_many_instances_of_few_meshes() -> None:
    made = crowd.make(crowd.COUNT)
    assert crowd.COUNT == 100_000
    assert len(made.instances) == crowd.COUNT + 1
    assert len(made.meshes) == 5


def test_a_hedge_lets_some_rays_through_all_its_layers() -> None:
    scene = load_scene("stress:hedge")
    (image,) = scene.images
    open_share = float((image.pixels[..., 3] < 128).mean())
    assert hedge.LAYERS >= 60
    assert 1e-4 < open_share**hedge.LAYERS < 0.1


def test_at_the_lens_things_cross_the_near_plane_and_blur_beyond_the_picture() -> None:
    scene = load_scene("stress:near-lens")
    (camera,) = scene.cameras
    near, depth = near_plane(*bounds(flatten(scene))), -corners(scene)[..., 2]
    assert np.count_nonzero((depth.min(1) < 0.0) & (depth.max(1) > near)) >= 4
    assert camera.aperture is not None
    assert camera.focus_distance is not None
    scale = coc_scale_px(camera.aperture, 1.0, np.radians(camera.fov_y_deg))
    assert -coc_px(0.05, scale, 1.0 / camera.focus_distance) > 1.0, "blurred beyond the picture's height"


def test_blades_stand_exactly_in_focus_and_a_rounding_error_beside() -> None:
    scene = load_scene("stress:knife-edges")
    depth = -flatten(scene).positions[:, 2]
    focus = np.float32(scene.cameras[0].focus_distance)
    for exact in (focus, np.nextafter(focus, np.float32(0)), np.nextafter(focus, np.float32(9))):
        assert np.count_nonzero(depth == exact) >= 4


def test_an_empty_scene_has_no_triangle() -> None:
    assert len(flatten(load_scene("stress:empty")).indices) == 0
    assert len(flatten(load_scene("stress:one-triangle")).indices) == 1
