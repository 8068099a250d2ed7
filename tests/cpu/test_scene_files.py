"""OBJ, PLY and STL, the built-in scene, and the real scenes."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import zlib
from hashlib import sha256
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
import trimesh

from app.data import data_dir
from app.errors import UserError
from app.optics import coc_px, coc_scale_px
from app.scene import gallery
from app.scene.flatten import flatten
from app.scene.load import load_scene

OBJ = """mtllib m.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 1 1 0
vt 0 0
vt 1 0
vt 0 1
vn 0 0 -1
usemtl red
f 1/1/1 2/2/1 3/3/1
usemtl glass
f 2/2/1 4/1/1 3/3/1
"""
MTL = """newmtl red
Kd 0.1 0.2 0.3
Ke 1 2 3
Ns 126
map_Kd t.png
map_Bump bump.png
newmtl glass
d 0.3
map_Kd ../outside.png
"""


@pytest.mark.parametrize("kind", ["obj", "ply", "stl"])
def test_a_solid_survives_every_format(tmp_path: Path, kind: str) -> None:
    solid = trimesh.creation.icosphere(2)
    solid.export(tmp_path / f"solid.{kind}")
    scene = load_scene(tmp_path / f"solid.{kind}")
    assert scene.report.triangles == len(solid.faces)
    assert scene.report.degenerate == 0
    flat = flatten(scene)
    points = flat.positions[flat.indices]
    assert np.allclose(np.linalg.norm(points, axis=-1), 1.0, atol=1e-5)
    assert (np.einsum("ijk,ijk->ij", points, flat.normals[flat.indices]) > 0.95).all()
    volume = np.einsum("ij,ij->i", points[:, 0].astype(float), np.cross(points[:, 1], points[:, 2])).sum() / 6
    assert volume == pytest.approx(solid.volume, rel=1e-5), "no triangle is lost, doubled or turned"


def test_obj_materials(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(OBJ)
    (tmp_path / "m.mtl").write_text(MTL)
    PIL.Image.new("RGB", (4, 4), (255, 0, 0)).save(tmp_path / "t.png")
    scene = load_scene(tmp_path / "m.obj")
    by_name = {m.name: m for m in scene.materials}
    red, glass = by_name["red"], by_name["glass"]
    assert red.base_color == (0.1, 0.2, 0.3, 1.0)
    assert red.emissive == (1.0, 2.0, 3.0)
    assert red.roughness == pytest.approx((2 / 128) ** 0.25)
    assert red.base_color_texture is not None
    assert (glass.base_color[3], glass.alpha_cutoff) == (0.3, 0.5)
    notes = " ".join(scene.report.notes)
    for word in ("map_bump", "'../outside.png'", "transparency"):
        assert word in notes
    flat = flatten(scene)
    assert np.allclose(flat.normals, (0, 0, -1)), "the file's normals, not computed ones"
    origin = (flat.positions == 0).all(axis=1)
    assert np.allclose(flat.uvs[origin], (0, 1)), "v grows downwards"


def test_obj_in_another_encoding_and_without_its_library(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_bytes("# caf\u00e9\n".encode("latin-1") + OBJ.encode())
    scene = load_scene(tmp_path / "m.obj")
    assert scene.report.triangles == 2
    assert any("'m.mtl' is missing" in note for note in scene.report.notes)


V3 = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("library", "names", "told"),
    [
        ("newmtl red\n", ("red", "nix"), "Material 'nix' is not in the material library 'a.mtl'; a plain one is used."),
        ("newmtl red\n", ("Red",), "Material 'Red' is"),  # as they are written
        ("newmtl red\n", ("a", "b", "a"), "Materials 'a', 'b' are"),
        ("newmtl dark red\n", ("dark red",), None),
        ("newmtl red\n", ("red",), None),
        (None, ("red", "blue"), "Material library 'a.mtl' is missing"),  # said once
        ("", ("red",), "Material 'red' is not in the material library 'a.mtl'"),
    ],
)
def test_a_material_that_the_library_lacks_is_noted(
    library: str | None, names: tuple[str, ...], told: str | None, tmp_path: Path
) -> None:
    faces = "".join(f"usemtl {name}\nf 1 2 3\n" for name in names)
    (tmp_path / "m.obj").write_text(f"mtllib a.mtl\n{V3}{faces}")
    if library is not None:
        (tmp_path / "a.mtl").write_text(library)
    notes = [note for note in load_scene(tmp_path / "m.obj").report.notes if "aterial" in note]
    assert len(notes) == (told is not None)
    assert all(note.startswith(told or "") for note in notes)


def test_a_material_without_any_library_is_noted(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(f"{V3}usemtl red\nf 1 2 3\n")
    assert (
        "The file names no material library: a plain material is used." in load_scene(tmp_path / "m.obj").report.notes
    )
    (tmp_path / "m.obj").write_text(f"{V3}f 1 2 3\n")
    assert not any("material" in note for note in load_scene(tmp_path / "m.obj").report.notes)


@pytest.mark.parametrize(
    ("face", "told"),
    [
        ("f 1 2 99", "line 4: a face refers to vertex 99, but the file has 3"),
        ("f 1 2 3\nf 1 2 4", "line 5: a face refers to vertex 4, but the file has 3"),
        ("f -9 -2 -1", "line 4: a face refers to vertex -9, but the file has 3"),
        ("f 1//1 2//1 99//1", "line 4: a face refers to vertex 99, but the file has 3"),
        ("f 1 2 " + "9" * 5000, "\u2026, but the file has 3"),
        ("f 1 2 9223372036854775808", "vertex 9223372036854775808, but the file has 3"),
    ],
)
def test_a_face_of_missing_vertices_is_told_by_their_number_in_the_file(face: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(f"{V3}{face}\n")
    with pytest.raises(UserError) as error:
        load_scene(tmp_path / "m.obj")
    assert told in str(error.value)
    assert str(tmp_path / "m.obj") in str(error.value)


@pytest.mark.parametrize("per", ["vertex", "face"])
def test_ply_colours(tmp_path: Path, per: str) -> None:
    solid = trimesh.creation.box()
    count = len(solid.vertices if per == "vertex" else solid.faces)
    colors = np.tile(np.array([188, 0, 255, 255], np.uint8), (count, 1))
    solid.visual = trimesh.visual.ColorVisuals(solid, **{f"{per}_colors": colors})
    solid.export(tmp_path / "c.ply")
    scene = load_scene(tmp_path / "c.ply")
    used = {scene.meshes[i.mesh].material for i in scene.instances}
    assert len(used) == 1
    color = scene.materials[used.pop()].base_color
    assert np.allclose(color, (0.5029, 0.0, 1.0, 1.0), atol=1e-3), "display colours become linear"


def test_colour_groups_keep_the_surface_smooth(tmp_path: Path) -> None:
    solid = trimesh.creation.icosphere(2)
    solid.visual.vertex_colors = np.random.default_rng(1).integers(0, 256, (len(solid.vertices), 4))
    solid.export(tmp_path / "c.ply")
    scene = load_scene(tmp_path / "c.ply")
    flat = flatten(scene)
    assert scene.report.triangles == len(solid.faces)
    assert 2 < len(scene.instances) <= 64
    assert (np.einsum("ij,ij->i", flat.normals, flat.positions) > 0.999).all()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("a.obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("a.obj", b""),
        ("a.obj", b"v 0 0 0\n"),
        ("a.obj", b"\xff\xfe\x00\x80" * 20),
        ("a.ply", b""),
        (
            "a.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\nproperty float x\nend_header\n",
        ),
        ("a.stl", b""),
        ("a.stl", b"x" * 80 + b"\xff\xff\xff\x7f" + b"\0" * 50),
    ],
)
def test_damaged_files_end_in_one_sentence(
    tmp_path: Path, name: str, content: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError) as error:
        load_scene(tmp_path / name)
    assert str(tmp_path / name) in str(error.value)
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


def test_gallery_names_are_found_and_nothing_else() -> None:
    assert gallery.find("still-life") is gallery.DEFAULT
    assert gallery.find("Still-Life.glb") is None
    assert all(scene.path.is_file() and scene.description for scene in gallery.SCENES)


def test_still_life_has_what_the_demo_needs() -> None:
    stages: list[str] = []
    scene = load_scene("still-life", lambda stage, fraction: stages.append(stage) if 0 <= fraction <= 1 else None)
    assert set(stages) == {"reading geometry", "decoding images", "checking geometry"}
    assert 30_000 <= scene.report.triangles <= 80_000
    assert scene.report.degenerate == 0
    assert gallery.DEFAULT.path.stat().st_size < 3_000_000
    (camera,) = scene.cameras
    assert camera.focus_distance is not None
    assert camera.aperture is not None
    assert [light.kind for light in scene.lights] == ["sun", "point", "point"]
    assert any(m.alpha_cutoff for m in scene.materials), "leaves"
    assert any(m.normal_texture for m in scene.materials), "relief"
    assert max(max(m.emissive) for m in scene.materials) > 10, "highlights"


def test_still_life_stands_on_both_sides_of_the_focal_plane() -> None:
    scene = load_scene("still-life")
    camera = scene.cameras[0]
    eye = np.array(camera.eye)
    forward = np.array(camera.target) - eye
    forward /= np.linalg.norm(forward)
    depth = {i.name: (i.transform[:3, 3] - eye) @ forward for i in scene.instances}
    leaves = [(i.transform[:3, 3] - eye) @ forward for i in scene.instances if i.name == "leaf"]
    assert max(leaves) < 0.6 * camera.focus_distance
    assert depth["bulb"] > 3 * camera.focus_distance
    assert abs(depth["vase"] - camera.focus_distance) < 0.15


def test_toy_train_moves_in_front_of_focus_in_it_and_stays_cheap() -> None:
    scene = load_scene("toy-train")
    assert gallery.find("toy-train").path.stat().st_size < 1_500_000
    assert scene.report.triangles < 60_000
    assert not scene.report.notes
    camera, flat = scene.cameras[0], flatten(scene)
    forward = np.subtract(camera.target, camera.eye) / np.linalg.norm(np.subtract(camera.target, camera.eye))
    depth = {m.motion.name: float((m.origin - camera.eye) @ forward) for m in flat.moving}
    assert depth.keys() == {"wind wheel 0", "wind wheel 1", "train", "axle 0", "axle 1"}
    assert abs(depth["train"] - camera.focus_distance) < 0.05
    scale = coc_scale_px(camera.aperture, 360, math.radians(camera.fov_y_deg))
    assert 15 < -coc_px(depth["wind wheel 0"], scale, 1 / camera.focus_distance) < 35
    assert max(max(m.emissive) for m in scene.materials) > 10, "highlights"


def test_the_toy_trains_wheels_roll_and_its_loop_closes() -> None:
    scene = load_scene("toy-train")
    moving = {i.motion.name: i for i in scene.instances if i.motion}
    train, axle = moving["train"], moving["axle 0"]
    radius = 0.5 * np.ptp(scene.meshes[axle.mesh].positions[:, 0])
    dt = 0.05
    ahead = train.motion.displacement(dt)[0, 3]
    turned = axle.motion.displacement(dt)[:2, :2]
    assert -math.atan2(turned[1, 0], turned[0, 0]) * radius == pytest.approx(ahead, rel=1e-3)
    for instance in (i for i in scene.instances if i.motion):
        before, after = (instance.motion.displacement(instance.motion.period + e) for e in (-1e-9, 1e-9))
        np.testing.assert_allclose(before, after, atol=1e-5)  # keys are float32


@pytest.mark.parametrize(("name", "script"), [("still-life", "make_still_life.py"), ("toy-train", "make_toy_train.py")])
def test_a_built_in_scene_is_what_its_script_makes(tmp_path: Path, name: str, script: str) -> None:
    env = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    made = tmp_path / "made.glb"
    subprocess.run([sys.executable, str(data_dir("assets") / script), str(made)], check=True, env=env)
    ours, committed = load_scene(made), load_scene(name)
    for a, b in zip(ours.meshes, committed.meshes, strict=True):
        assert np.array_equal(a.positions, b.positions)
        assert np.array_equal(a.triangles, b.triangles)
    for a, b in zip(ours.images, committed.images, strict=True):
        assert np.array_equal(a.pixels, b.pixels)
    assert (ours.materials, ours.lights, ours.cameras) == (committed.materials, committed.lights, committed.cameras)
    if "ng" not in zlib.ZLIB_RUNTIME_VERSION:  # zlib-ng deflates the same pixels to other bytes
        assert sha256(made.read_bytes()).digest() == sha256(gallery.find(name).path.read_bytes()).digest()


@pytest.mark.parametrize(
    ("name", "triangles", "degenerate"),
    [
        ("greywhite_room.glb", 143_163, 190),
        ("modern_living_room_partial.glb", 295_906, 256),
        ("flight_helmet/FlightHelmet.gltf", 94_722, 0),
    ],
)
def test_real_scenes(shared_scenes: Path, name: str, triangles: int, degenerate: int) -> None:
    scene = load_scene(shared_scenes / name)
    assert (scene.report.triangles, scene.report.degenerate) == (triangles, degenerate)
    flat = flatten(scene)
    assert len(flat.indices) == triangles - degenerate
    assert int(flat.indices.max()) < len(flat.positions) == scene.report.vertices
    assert np.allclose(np.linalg.norm(flat.normals, axis=1), 1.0, atol=1e-5)


def test_computed_tangents_agree_with_an_artists_tool(shared_scenes: Path) -> None:
    """FlightHelmet carries tangents baked by its author: ours, computed from the same uvs, must mostly coincide."""
    from app.scene.validate import with_tangents

    for mesh in load_scene(shared_scenes / "flight_helmet/FlightHelmet.gltf").meshes:
        ours = with_tangents(mesh, np.eye(2, 3))
        corner, same = mesh.tangents[mesh.triangles], ours.tangents[ours.triangles]
        agree = np.einsum("ijk,ijk->ij", corner[..., :3], same[..., :3]) > 0.9
        assert agree.mean() > 0.9
        assert (corner[..., 3] == same[..., 3]).mean() > 0.98
