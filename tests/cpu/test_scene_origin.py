"""Scenes far from the world's origin, and what is said of those that float32 cannot resolve."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.scene.flatten import bounds, flatten, places, rest_box
from app.scene.geometry import local_origin
from app.scene.load import load_scene
from app.scene.model import Scene

from .gltf_maker import CORNERS, Maker

coordinate = st.floats(-1e9, 1e9, allow_subnormal=True)
extent = st.floats(0.0, 1e9, allow_subnormal=True)


@settings(max_examples=500, deadline=None)
@given(middle=st.tuples(*[coordinate] * 3), size=st.tuples(*[extent] * 3))
def test_coordinates_about_the_origin_are_as_small_as_the_scene(
    middle: tuple[float, ...], size: tuple[float, ...]
) -> None:
    """Within 2.5 diagonals, of which float32 resolves 2^-22: that is half a step and half the box."""
    low, high = (np.array(middle) + sign * np.array(size) / 2 for sign in (-1, 1))
    origin = local_origin(low, high)
    diagonal = max(float(np.linalg.norm(high - low)), 1e-6)
    assert np.abs([low - origin, high - origin]).max() <= 2.5 * diagonal + 1e-15 * np.abs(origin).max()


@settings(max_examples=200, deadline=None)
@given(middle=st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_scenes_about_the_worlds_origin_keep_their_coordinates(middle: tuple[float, ...]) -> None:
    """A box that holds the world's origin, or is no farther from it than its own half diagonal."""
    half = np.array([1.0, 0.5, 2.0])
    centre = np.array(middle) * np.linalg.norm(half)
    np.testing.assert_array_equal(local_origin(centre - half, centre + half), 0.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e308])
def test_boxes_that_are_not_finite_have_no_origin_of_their_own(bad: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(local_origin(np.array([-bad, 0, 0]), np.array([bad, 1, 1])), 0.0)


def moved(scene: Scene, by: np.ndarray) -> Scene:
    """The scene with what stands still moved [m]."""
    placed = np.eye(4)
    placed[:3, 3] = by
    return replace(scene, instances=tuple(replace(i, transform=placed @ i.transform) for i in scene.instances))


def test_moving_a_scene_changes_nothing_but_its_origin() -> None:
    scene = load_scene("still-life")
    step, here = 64.0, flatten(scene)
    by = step * np.array([1563.0, -12.0, 3.0])
    there = flatten(moved(scene, by))
    np.testing.assert_array_equal(here.origin, 0)
    np.testing.assert_array_equal(there.origin, by)
    np.testing.assert_allclose(there.positions, here.positions, rtol=2.0**-23, atol=1e5 * 2.0**-52)
    np.testing.assert_allclose(bounds(there), np.array(bounds(here)) + by, rtol=1e-12)


def test_boxes_at_rest_hold_what_is_baked() -> None:
    scene = load_scene("toy-train")
    low, high = rest_box(scene.meshes, scene.instances)
    flat = flatten(scene)
    at_rest = np.concatenate([np.eye(4)[None], places(flat.moving, 0.0)])[flat.objects]
    world = np.einsum("nij,nj->ni", at_rest[:, :3, :3], flat.positions.astype(float)) + at_rest[:, :3, 3] + flat.origin
    assert (world >= low - 1e-6).all()
    assert (world <= high + 1e-6).all()


# -- what files hold ---------------------------------------------------------------------------------------------------

EASTING, NORTHING = 476812.3125, 5429013.4375  # m: map coordinates, as surveyed models have


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_text_files_in_map_coordinates_keep_their_millimetres(tmp_path: Path, suffix: str) -> None:
    """float32 would round northings to half a metre."""
    shape = np.array([[0, 0, 0], [0.25, 0, 0], [0.25, 0.125, 0], [0, 0.125, 0.001]])
    vertices = np.add(shape, [EASTING, NORTHING, 0])
    lines = [" ".join(f"{x:.4f}" for x in v) for v in vertices]
    if suffix == ".obj":
        text = "\n".join([*(f"v {line}" for line in lines), "f 1 2 3", "f 1 3 4"]) + "\n"
    else:
        header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
        text = header + "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
        text += "\n".join([*lines, "3 0 1 2", "3 0 2 3"]) + "\n"
    path = tmp_path / f"plot{suffix}"
    path.write_text(text)
    scene = load_scene(path)
    flat = flatten(scene)
    corners = flat.positions[flat.indices[0]].astype(float) + flat.origin
    np.testing.assert_allclose(corners - [EASTING, NORTHING, 0], shape[:3], rtol=0, atol=1e-4)
    assert len(flat.indices) == 2
    assert not any("32-bit" in note for note in scene.report.notes)


@pytest.mark.parametrize(("at", "by_node", "noted"), [(1e5, False, True), (1e5, True, False), (100.0, False, False)])
def test_a_mesh_that_its_file_rounds_coarsely_is_reported(
    tmp_path: Path, at: float, by_node: bool, noted: bool
) -> None:
    """A triangle of 1 m some way off, baked into its vertices or placed by its node; glTF stores float32 only."""
    maker = Maker()
    corners = np.add(CORNERS, [0.0 if by_node else at, 0, 0])
    mesh = maker.mesh(maker.primitive(maker.accessor(corners.astype("<f4"))))
    maker.node(mesh=mesh, translation=[at if by_node else 0.0, 0, 0])
    scene = load_scene(maker.write(tmp_path / "far.gltf"))
    notes = [note for note in scene.report.notes if "32-bit" in note]
    assert len(notes) == noted
    if noted:
        assert "1 mesh lies so far from its own origin" in notes[0]
        assert "7.8 mm" in notes[0]


@pytest.mark.parametrize(("size", "noted"), [(1e3, False), (1e5, True)])
def test_a_scene_too_wide_for_millimetres_is_reported(tmp_path: Path, size: float, noted: bool) -> None:
    maker = Maker()
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor((CORNERS * np.float32(size)).astype("<f4")))))
    scene = load_scene(maker.write(tmp_path / "wide.gltf"))
    notes = [note for note in scene.report.notes if "across" in note]
    assert len(notes) == noted
    if noted:
        assert "141 km across: at its rim positions are kept to 7.8 mm" in notes[0]
