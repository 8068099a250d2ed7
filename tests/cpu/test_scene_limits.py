"""What a file's numbers, names and counts may be, and what becomes of those that are beyond."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from app.bvh.build import build_bvh
from app.errors import UserError, quoted
from app.scene import gltf_accessors, images, load, validate
from app.scene.bounded import MAX_RADIANCE
from app.scene.flatten import flatten
from app.scene.load import load_scene
from app.session import open_scene

from .gltf_maker import CORNERS, Maker, png

ROOT = Path(__file__).parents[2]


def many_meshes(count: int) -> Maker:
    """As many meshes, materials and nodes of one triangle each."""
    maker = Maker()
    view = maker.view(b"".join((CORNERS + np.float32([i % 317, i // 317, 0])).tobytes() for i in range(count)))
    for i in range(count):
        material = maker.add("materials", {"pbrMetallicRoughness": {"roughnessFactor": i / count}})
        place = {"bufferView": view, "byteOffset": 36 * i, "componentType": 5126, "count": 3, "type": "VEC3"}
        mesh = maker.mesh(maker.primitive(maker.add("accessors", place), material=material))
        maker.node(mesh=mesh, translation=[0, 0, i % 7], rotation=[0, 0, 0, 1])
    return maker


def prepare(path: Path) -> float:
    """Seconds of processor time until a scene could go to the GPU."""
    begin = time.process_time()
    triangles = flatten(load_scene(path))
    build_bvh(triangles.positions, triangles.indices)
    return time.process_time() - begin


def test_time_grows_with_the_number_of_meshes_and_no_faster(tmp_path: Path, soak: bool) -> None:
    few, factor = 500, 200 if soak else 8
    prepare(many_meshes(few).write(tmp_path / "first.glb"))  # imports
    short = min(prepare(many_meshes(few).write(tmp_path / "few.glb")) for _ in range(2))
    long = prepare(many_meshes(factor * few).write(tmp_path / "many.glb"))
    print(f"{few} meshes {short:.2f} s, {factor * few} meshes {long:.2f} s")
    assert long < 2.0 * factor * short, "a quadratic step would take the factor once more"


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="only Linux tells the peak of one program")
def test_a_hundred_thousand_meshes_take_two_gigabytes_at_most(tmp_path: Path, soak: bool) -> None:
    count, most = (100_000, 2 << 30) if soak else (2000, 300 << 20)
    path = many_meshes(count).write(tmp_path / "many.glb")
    code = (
        "import sys; from app.session import open_scene; scene, triangles = open_scene(sys.argv[1]);"
        # Not getrusage: its peak of a new program begins at that of the process which started it.
        "(peak,) = [line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')];"
        "print(len(triangles.indices), int(peak) * 1024)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], cwd=ROOT, capture_output=True, text=True, check=True)
    triangles, peak = map(int, done.stdout.split())
    print(f"{count} meshes: {peak >> 20} MiB")
    assert triangles == count
    assert peak < most


def test_counts_are_added_up_while_they_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    maker = Maker()
    primitive = maker.primitive(maker.accessor(CORNERS))
    maker.node(mesh=maker.mesh(*[primitive] * 5))
    path = maker.write(tmp_path / "a.glb")
    monkeypatch.setattr(validate, "MAX_TRIANGLES", 4)
    with pytest.raises(UserError, match="5 triangles, over the limit of 4"):
        load_scene(path)


def test_placed_vertices_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    maker = Maker()
    mesh = maker.mesh(maker.primitive(maker.accessor(CORNERS)))
    for _ in range(4):
        maker.node(mesh=mesh)
    path = maker.write(tmp_path / "a.glb")
    assert load_scene(path).report.vertices == 12
    monkeypatch.setattr(load, "MAX_VERTICES", 11)
    with pytest.raises(UserError, match="places 12 vertices, over the limit of 11"):
        load_scene(path)


def test_an_accessor_without_bytes_may_not_be_large(tmp_path: Path) -> None:
    for count, fine in ((gltf_accessors.MAX_ZEROS, True), (gltf_accessors.MAX_ZEROS + 1, False)):
        maker = Maker()
        maker.triangle()
        zeros = maker.add("accessors", {"componentType": 5126, "count": count, "type": "VEC3"})
        maker.node(mesh=maker.mesh(maker.primitive(zeros)))
        path = maker.write(tmp_path / "a.glb")
        if fine:
            assert len(flatten(load_scene(path)).indices) == 1
        else:
            with pytest.raises(UserError, match=f"claims {count} elements"):
                load_scene(path)


def textured(sides: list[int]) -> Maker:
    maker = Maker()
    uvs = maker.accessor(CORNERS[:, :2].copy())
    for side in sides:
        image = maker.add("images", {"bufferView": maker.view(png(np.zeros((side, side, 3), np.uint8)))})
        texture = maker.add("textures", {"source": image})
        pbr = {"baseColorTexture": {"index": texture}}
        maker.triangle(material=maker.add("materials", {"pbrMetallicRoughness": pbr}), TEXCOORD_0=uvs)
    return maker


@pytest.mark.parametrize(
    ("limit", "value", "says"),
    [
        ("MAX_SIDE", 7, "larger than 7 pixels a side"),
        ("MAX_PIXELS", 63, "larger than"),
        ("MAX_ALL_PIXELS", 191, "its 3 images have"),
    ],
)
def test_pictures_are_measured_before_they_are_inflated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str, value: int, says: str
) -> None:
    path = textured([8, 8, 8]).write(tmp_path / "a.glb")
    monkeypatch.setattr(images, limit, value + 1)
    assert len(load_scene(path).images) == 3
    monkeypatch.setattr(images, limit, value)
    monkeypatch.setattr(images, "pixels", lambda picture: pytest.fail("inflated"))
    with pytest.raises(UserError, match=says):
        load_scene(path)


def test_numbers_of_materials_lights_and_cameras_are_brought_into_range(tmp_path: Path) -> None:
    maker = Maker()
    pbr = {"baseColorFactor": [-1, 2, 0.5, 9], "metallicFactor": 1e30, "roughnessFactor": -1}
    glow = {"KHR_materials_emissive_strength": {"emissiveStrength": 1e300}}
    odd = maker.add(
        "materials", {"name": "odd", "pbrMetallicRoughness": pbr, "emissiveFactor": [1, 0, 0], "extensions": glow}
    )
    maker.triangle(material=odd)
    maker.triangle(material=maker.add("materials", {"name": "plain"}))
    lights = [{"type": "point", "intensity": 1e300, "color": [1, 2, 4]}, {"type": "point"}, {"type": "directional"}]
    maker.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    for light, place in enumerate(([0, 0, 0], [1e300, 0, 0], [0, 0, 0])):
        maker.node(extensions={"KHR_lights_punctual": {"light": light}}, translation=place)
    for fov in (1e-300, 1.0, 3.1415):
        maker.node(
            camera=maker.add("cameras", {"type": "perspective", "perspective": {"yfov": fov}, "name": f"{fov:g}"})
        )
    scene = load_scene(maker.write(tmp_path / "a.glb"))
    material = scene.materials[0]
    assert material.base_color == (0.0, 1.0, 0.5, 1.0)
    assert (material.metallic, material.roughness, material.emissive) == (1.0, 0.0, (MAX_RADIANCE, 0.0, 0.0))
    assert [light.kind for light in scene.lights] == ["point", "sun"]
    assert scene.lights[0].intensity * 4 == MAX_RADIANCE
    assert [camera.name for camera in scene.cameras] == ["1"]
    told = " ".join(scene.report.notes)
    for words in ("Material 'odd' had numbers out of range", "A light is farther than", "'1e-300' was left out"):
        assert words in told
    assert "plain" not in told


@pytest.mark.parametrize("number", ["1e999", "-1e999", "NaN", "Infinity"])
def test_a_number_that_no_float_holds_is_refused_wherever_it_is(tmp_path: Path, number: str) -> None:
    """JSON allows 1e999, which a parser makes infinite without a word."""
    maker = Maker()
    maker.triangle(material=maker.add("materials", {"normalTexture": {"index": 0, "scale": 0.125}}))
    text = maker.write(tmp_path / "a.gltf").read_text()
    (tmp_path / "a.gltf").write_text(text.replace("0.125", number))
    with pytest.raises(UserError, match=r"no finite number|no JSON number"):
        load_scene(tmp_path / "a.gltf")


def test_a_camera_far_from_the_origin_looks_where_it_should(tmp_path: Path) -> None:
    """Its target must be another point than the eye, and in the right direction, in float64."""
    maker = Maker()
    maker.triangle()
    lens = {"focus_distance": 1e-300}
    camera = maker.add("cameras", {"type": "perspective", "perspective": {"yfov": 1.0}, "extras": lens})
    maker.node(camera=camera, translation=[5e8, 0, 0], rotation=[0, math.sqrt(0.5), 0, math.sqrt(0.5)])
    (found,) = load_scene(maker.write(tmp_path / "a.glb")).cameras
    ahead = np.subtract(found.target, found.eye)
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), (-1, 0, 0), atol=1e-9)


def test_a_mesh_pressed_flat_keeps_normals_that_light_can_use(tmp_path: Path) -> None:
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], "<f4")
    faces = np.array([(x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)], "<u2")
    maker = Maker()
    primitive = maker.primitive(maker.accessor(points), faces.ravel(), NORMAL=maker.accessor(points))
    maker.node(mesh=maker.mesh(primitive), scale=[1, 0, 1])
    flat = flatten(load_scene(maker.write(tmp_path / "a.glb")))
    np.testing.assert_allclose(np.abs(flat.normals[flat.indices]), np.broadcast_to((0, 1, 0), (*flat.indices.shape, 3)))


def test_what_collapses_where_it_is_placed_is_refused(tmp_path: Path) -> None:
    maker = Maker()
    maker.json["nodes"] = []
    maker.json["nodes"] += [{"mesh": maker.mesh(maker.primitive(maker.accessor(CORNERS))), "scale": [0, 0, 0]}]
    maker.json["scenes"][0]["nodes"] = [0]
    path = maker.write(tmp_path / "a.glb")
    with pytest.raises(UserError, match="no triangle that could be drawn"):
        open_scene(str(path))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("Küche", "Küche"),
        ("a\n\tb", "a b"),
        ("\x1b[31mred", "\ufffd[31mred"),
        ("\ud800\u202e", "\ufffd\ufffd"),
        ("x" * 200, "x" * 119 + "…"),
        (7, "7"),
    ],
)
def test_text_from_a_file_is_one_line_that_a_terminal_only_shows(text: object, line: str) -> None:
    assert quoted(text) == line


def test_info_can_be_read_on_a_terminal_that_knows_ascii_only(tmp_path: Path) -> None:
    maker = Maker()
    maker.triangle()
    maker.node(camera=maker.add("cameras", {"type": "perspective", "perspective": {"yfov": 1.0}, "name": "Küche"}))
    path = maker.write(tmp_path / os.fsdecode(b"caf\xe9.glb"))  # a name in another encoding than the system's
    env = os.environ | {"PYTHONIOENCODING": "ascii:strict"}
    command = [sys.executable, "-m", "app", "info", str(path)]
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"camera K\xfcche" in done.stdout
