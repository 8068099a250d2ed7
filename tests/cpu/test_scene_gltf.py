"""What glTF files say, exactly: accessors, materials, textures, graph, cameras, lights."""

from __future__ import annotations

import math
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

from app.camera import look_at
from app.scene.flatten import flatten
from app.scene.load import load_scene
from app.scene.model import Material, Scene

from .gltf_maker import CORNERS, Maker, png

RED = np.full((2, 2, 3), (200, 10, 20), np.uint8)


@pytest.fixture
def maker() -> Maker:
    return Maker()


def load(maker: Maker, folder: Path, name: str = "t.glb") -> Scene:
    return load_scene(maker.write(folder / name))


def textured(maker: Maker, material: dict, **primitive: object) -> None:
    """A triangle with `material` and uvs; image and texture 0 exist."""
    maker.add("images", {"bufferView": maker.view(png(RED)), "mimeType": "image/png"})
    maker.add("textures", {"source": 0})
    maker.triangle(material=maker.add("materials", material), TEXCOORD_0=maker.accessor(CORNERS[:, :2]), **primitive)


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_both_containers_give_the_same_triangle(maker: Maker, tmp_path: Path, suffix: str) -> None:
    maker.triangle()
    scene = load(maker, tmp_path, f"t.{suffix}")
    assert np.array_equal(scene.meshes[0].positions, CORNERS)
    assert scene.report.triangles == 1
    assert scene.cameras == ()
    assert scene.lights == ()


def test_interleaved_attributes(maker: Maker, tmp_path: Path) -> None:
    rows = np.zeros(3, [("p", "<f4", 3), ("n", "<f4", 3), ("uv", "<f4", 2)])
    rows["p"], rows["n"], rows["uv"] = CORNERS, (0, 0, 1), [[0, 0], [0.25, 0], [0, 0.75]]
    view = maker.view(rows.tobytes(), byteStride=rows.itemsize)
    p, n, uv = (
        maker.add("accessors", {"bufferView": view, "byteOffset": o, "componentType": 5126, "count": 3, "type": t})
        for o, t in ((0, "VEC3"), (12, "VEC3"), (24, "VEC2"))
    )
    maker.node(mesh=maker.mesh(maker.primitive(p, NORMAL=n, TEXCOORD_0=uv)))
    mesh = load(maker, tmp_path).meshes[0]
    assert np.array_equal(mesh.positions, rows["p"])
    assert np.array_equal(mesh.normals, rows["n"])
    assert np.array_equal(mesh.uvs, rows["uv"])


@pytest.mark.parametrize(("dtype", "largest"), [("<u1", 255), ("<u2", 65535), ("<i1", 127), ("<i2", 32767)])
def test_normalised_integers_span_zero_to_one(maker: Maker, tmp_path: Path, dtype: str, largest: int) -> None:
    low = -largest - 1 if dtype[1] == "i" else 0
    stored = np.array([[0, 0], [largest, 0], [low, largest]], dtype)
    maker.triangle(TEXCOORD_0=maker.accessor(stored, normalized=True))
    expected = np.maximum(stored / np.float32(largest), -1.0)
    assert np.array_equal(load(maker, tmp_path).meshes[0].uvs, expected.astype(np.float32))


@pytest.mark.parametrize("based", [True, False])
def test_sparse_accessor_replaces_single_elements(maker: Maker, tmp_path: Path, based: bool) -> None:
    values = np.array([[5, 6, 7]], "<f4") if based else CORNERS[1:]
    where = np.array([1], "<u2") if based else np.array([1, 2], "<u2")
    sparse = {
        "count": len(where),
        "indices": {"bufferView": maker.view(where.tobytes()), "componentType": 5123},
        "values": {"bufferView": maker.view(values.tobytes())},
    }
    if based:
        positions = maker.accessor(CORNERS, sparse=sparse)
    else:
        positions = maker.add("accessors", {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse})
    maker.node(mesh=maker.mesh(maker.primitive(positions)))
    expected = CORNERS.copy()
    expected[where] = values
    assert np.array_equal(load(maker, tmp_path).meshes[0].positions, expected)


@pytest.mark.parametrize(("mode", "count"), [(4, 1), (5, 3), (6, 3)])
def test_lists_strips_and_fans(maker: Maker, tmp_path: Path, mode: int, count: int) -> None:
    ring = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 3, 0], [0, 2, 0]], "<f4")
    positions = ring if mode != 5 else ring[[0, 1, 4, 2, 3]]
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(positions), np.arange(5, dtype="<u1"), mode=mode)))
    mesh = load(maker, tmp_path).meshes[0]
    assert len(mesh.triangles) == count
    edges = mesh.positions[mesh.triangles]
    normals = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    assert (normals[:, 2] > 0).all(), "all wind the same way"


def test_material_factors_stay_floats(maker: Maker, tmp_path: Path) -> None:
    color = [0.123456, 0.2, 0.3, 0.75]
    pbr = {"baseColorFactor": color, "metallicFactor": 0.321, "roughnessFactor": 0.654}
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 12.5}}
    maker.triangle(
        material=maker.add(
            "materials", {"pbrMetallicRoughness": pbr, "emissiveFactor": [1.0, 0.5, 0.25], "extensions": strength}
        )
    )
    material = load(maker, tmp_path).materials[0]
    assert material.base_color == tuple(color)
    assert (material.metallic, material.roughness) == (0.321, 0.654)
    assert material.emissive == (12.5, 6.25, 3.125)
    assert material.alpha_cutoff is None


def test_default_material_is_the_formats_own(maker: Maker, tmp_path: Path) -> None:
    maker.triangle()
    material = load(maker, tmp_path).materials[0]
    assert astuple(material)[:3] == astuple(Material(metallic=1.0))[:3]


@pytest.mark.parametrize(
    ("fields", "cutoff"),
    [
        ({"alphaMode": "MASK", "alphaCutoff": 0.3}, 0.3),
        ({"alphaMode": "MASK"}, 0.5),
        ({"alphaMode": "MASK", "alphaCutoff": 0.0}, None),
        ({"alphaMode": "OPAQUE", "alphaCutoff": 0.3}, None),
        ({"alphaMode": "BLEND"}, 0.5),
    ],
)
def test_alpha_modes(maker: Maker, tmp_path: Path, fields: dict, cutoff: float | None) -> None:
    textured(maker, {**fields, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    scene = load(maker, tmp_path)
    assert scene.materials[0].alpha_cutoff == cutoff
    assert any("blending" in note for note in scene.report.notes) == (fields["alphaMode"] == "BLEND")


def test_mask_without_texture_is_decided_once(maker: Maker, tmp_path: Path) -> None:
    for alpha in (0.9, 0.2):
        pbr = {"baseColorFactor": [1, 1, 1, alpha]}
        maker.triangle(material=maker.add("materials", {"alphaMode": "MASK", "pbrMetallicRoughness": pbr}))
    assert [m.alpha_cutoff for m in load(maker, tmp_path).materials] == [None, 0.5]


def test_wrap_modes(maker: Maker, tmp_path: Path) -> None:
    textured(maker, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    maker.json["textures"][0]["sampler"] = maker.add("samplers", {"wrapS": 33071, "wrapT": 33648, "magFilter": 9728})
    scene = load(maker, tmp_path)
    slot = scene.materials[0].base_color_texture
    assert slot is not None
    assert (slot.wrap_u, slot.wrap_v) == ("clamp", "mirror")
    assert any("nearest" in note for note in scene.report.notes)


def test_texture_transform_selects_the_quadrant_of_the_specifications_example(maker: Maker, tmp_path: Path) -> None:
    transform = {"offset": [0, 1], "rotation": math.pi / 2, "scale": [0.5, 0.5]}
    info = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    textured(maker, {"pbrMetallicRoughness": {"baseColorTexture": info}})
    slot = load(maker, tmp_path).materials[0].base_color_texture
    assert slot is not None
    corners = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]]) @ np.array(slot.uv_transform).T
    assert np.allclose(corners.min(axis=0), (0.0, 0.5))
    assert np.allclose(corners.max(axis=0), (0.5, 1.0))


def test_one_image_serves_as_colour_and_as_data(maker: Maker, tmp_path: Path) -> None:
    pbr = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}}
    textured(maker, {"pbrMetallicRoughness": pbr, "emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1]})
    scene = load(maker, tmp_path)
    material = scene.materials[0]
    assert [image.srgb for image in scene.images] == [True, False]
    assert material.base_color_texture == material.emissive_texture
    assert (scene.images[0].pixels == [200, 10, 20, 255]).all()


def test_image_with_percent_encoded_name(maker: Maker, tmp_path: Path) -> None:
    (tmp_path / "two words.png").write_bytes(png(RED))
    textured(maker, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    maker.json["images"][0] = {"uri": "two%20words.png"}
    assert (load(maker, tmp_path, "t.gltf").images[0].pixels[0, 0] == [200, 10, 20, 255]).all()


def test_sixteen_bit_grey_keeps_its_scale(maker: Maker, tmp_path: Path) -> None:
    textured(maker, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    maker.json["images"][0] = {"bufferView": maker.view(png(np.full((2, 2), 0x8000, np.uint16)))}
    assert (load(maker, tmp_path).images[0].pixels == [128, 128, 128, 255]).all()


def test_second_texture_coordinate_set(maker: Maker, tmp_path: Path) -> None:
    other = (CORNERS[:, :2] * 3).astype("<f4")
    pbr = {"baseColorTexture": {"index": 0, "texCoord": 1}, "metallicRoughnessTexture": {"index": 0}}
    textured(maker, {"pbrMetallicRoughness": pbr}, TEXCOORD_1=maker.accessor(other))
    scene = load(maker, tmp_path)
    assert np.array_equal(scene.meshes[0].uvs, other)
    assert any("several coordinate sets" in note for note in scene.report.notes)


def test_unsupported_features_are_named(maker: Maker, tmp_path: Path) -> None:
    extensions = {"KHR_materials_unlit": {}, "KHR_materials_clearcoat": {}}
    textured(maker, {"extensions": extensions, "occlusionTexture": {"index": 0}})
    maker.json["animations"] = [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}, {}]
    notes = " ".join(load(maker, tmp_path).report.notes)
    for word in ("unlit", "KHR_materials_clearcoat", "occlusion", "weights", "2 animations"):
        assert word in notes


def test_vertex_colours_tint_materials(maker: Maker, tmp_path: Path) -> None:
    quad = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")
    colors = np.array([[255, 0, 0]] * 3 + [[0, 255, 0]] * 3, "<u1")
    positions = maker.accessor(quad[[0, 1, 2, 0, 2, 3]])
    maker.node(mesh=maker.mesh(maker.primitive(positions, COLOR_0=maker.accessor(colors, normalized=True))))
    scene = load(maker, tmp_path)
    seen = {scene.materials[scene.meshes[i.mesh].material].base_color for i in scene.instances}
    assert seen == {(1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)}


def test_camera_takes_the_world_transform_and_the_vertical_angle(maker: Maker, tmp_path: Path) -> None:
    maker.triangle()
    extras = {"focus_distance": 2.5, "aperture": 0.04}
    perspective = {"yfov": math.radians(40), "aspectRatio": 2.0, "znear": 0.1}
    camera = maker.add("cameras", {"type": "perspective", "perspective": perspective, "extras": extras})
    quarter = math.sqrt(0.5)
    child = maker.node(root=False, camera=camera, translation=[0, 0, 3])
    # The parent turns -z into -x (a quarter turn about y) and scales; the camera must shrug the scale off.
    maker.node(children=[child], translation=[1, 2, 3], rotation=[0, quarter, 0, quarter], scale=[2, 2, 2])
    (camera,) = load(maker, tmp_path).cameras
    assert np.allclose(camera.eye, (7, 2, 3))
    assert np.allclose(look_at(camera.eye, camera.target).forward, (-1, 0, 0))
    assert np.allclose(camera.up, (0, 1, 0))
    assert camera.fov_y_deg == pytest.approx(40)
    assert (camera.focus_distance, camera.aperture) == (2.5, 0.04)


def test_lights_in_world_space(maker: Maker, tmp_path: Path) -> None:
    maker.triangle()
    lights = [
        {"type": "directional", "intensity": 3, "color": [1, 0.5, 0.25]},
        {"type": "point", "range": 9},
        {"type": "spot", "intensity": 2, "spot": {"outerConeAngle": 0.6, "innerConeAngle": 0.2}},
        {"type": "point", "intensity": 0},
    ]
    maker.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    half = math.sqrt(0.5)
    for index in range(len(lights)):
        reference = {"KHR_lights_punctual": {"light": index}}
        maker.node(extensions=reference, translation=[index, 1, 2], rotation=[-half, 0, 0, half])
    sun, point, spot = load(maker, tmp_path).lights
    assert (sun.kind, sun.intensity, sun.color) == ("sun", 3.0, (1.0, 0.5, 0.25))
    assert np.allclose(sun.direction, (0, -1, 0))
    assert (point.kind, point.intensity, point.range, point.position) == ("point", 1.0, 9.0, (1.0, 1.0, 2.0))
    assert (spot.kind, spot.inner_cone, spot.outer_cone) == ("spot", 0.2, 0.6)
    assert math.isinf(sun.range)


def test_matrix_and_trs_nodes_agree(maker: Maker, tmp_path: Path) -> None:
    mesh = maker.mesh(maker.primitive(maker.accessor(CORNERS)))
    turn = [0.1, 0.7, -0.2, 0.6]
    maker.node(mesh=mesh, translation=[1, 2, 3], rotation=turn, scale=[1, -2, 3])
    first = load(maker, tmp_path).instances[0].transform
    maker.node(mesh=mesh, matrix=first.T.ravel().tolist())
    second = load(maker, tmp_path).instances[1].transform
    assert np.allclose(first, second, atol=1e-15)
    assert np.linalg.det(first) == pytest.approx(-6.0)


def test_environment_from_extras(maker: Maker, tmp_path: Path) -> None:
    maker.triangle()
    maker.json["scenes"][0]["extras"] = {"environment": {"sky": [1, 2, 3], "ground": [0, 0, 0.5]}}
    environment = load(maker, tmp_path).environment
    assert (environment.sky, environment.ground) == ((1.0, 2.0, 3.0), (0.0, 0.0, 0.5))


def test_shared_mesh_is_stored_once_and_drawn_twice(maker: Maker, tmp_path: Path) -> None:
    mesh = maker.mesh(maker.primitive(maker.accessor(CORNERS)))
    for x in (0, 5):
        maker.node(mesh=mesh, translation=[x, 0, 0])
    scene = load(maker, tmp_path)
    assert len(scene.meshes) == 1
    assert scene.report.triangles == 2
    assert flatten(scene).positions[:, 0].tolist() == [0, 1, 0, 5, 6, 5]
