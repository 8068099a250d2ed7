"""Broken and hostile files end in one sentence that names the file, never in a traceback or a surprise."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.errors import UserError
from app.scene.load import load_scene

from .gltf_maker import CORNERS, Maker


def bad_position(maker: Maker) -> None:
    broken = CORNERS.copy()
    broken[1, 1] = np.nan
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(broken))))


def index_out_of_range(maker: Maker) -> None:
    maker.triangle(indices=np.array([0, 1, 3], "<u2"))


def huge_count(maker: Maker) -> None:
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(CORNERS, count=2**40))))


def huge_count_without_view(maker: Maker) -> None:
    accessor = maker.add("accessors", {"componentType": 5126, "count": 2**40, "type": "VEC3"})
    maker.node(mesh=maker.mesh(maker.primitive(accessor)))


def count_past_view(maker: Maker) -> None:
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(CORNERS, count=4))))


def negative_offset(maker: Maker) -> None:
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(CORNERS, byteOffset=-4))))


def view_past_buffer(maker: Maker) -> None:
    maker.triangle()
    maker.json["bufferViews"][0]["byteLength"] = 10**9


def cycle(maker: Maker) -> None:
    maker.triangle()
    maker.json["nodes"][0]["children"] = [maker.node(root=False, children=[0])]


def two_parents(maker: Maker) -> None:
    child = maker.node(root=False)
    maker.triangle()
    maker.node(children=[child])
    maker.node(children=[child])


def cycle_without_scenes(maker: Maker) -> None:
    cycle(maker)
    del maker.json["scenes"], maker.json["scene"]


def missing_buffer(maker: Maker) -> None:
    maker.triangle()
    maker.json["buffers"] = [{"byteLength": 36, "uri": "absent.bin"}]


def traversal(maker: Maker) -> None:
    maker.triangle()
    maker.json["buffers"] = [{"byteLength": 36, "uri": "%2e%2e/secret.bin"}]


def absolute_path(maker: Maker) -> None:
    maker.triangle()
    maker.json["buffers"] = [{"byteLength": 36, "uri": "/etc/passwd"}]


def remote(maker: Maker) -> None:
    maker.triangle()
    maker.json["buffers"] = [{"byteLength": 36, "uri": "https://example.org/a.bin"}]


def bad_image(uri: str | None) -> Callable[[Maker], None]:
    def make(maker: Maker) -> None:
        image = {"bufferView": maker.view(b"not an image")} if uri is None else {"uri": uri}
        maker.add("textures", {"source": maker.add("images", image)})
        pbr = {"baseColorTexture": {"index": 0}}
        maker.triangle(material=maker.add("materials", {"pbrMetallicRoughness": pbr}))

    return make


def missing_mesh(maker: Maker) -> None:
    maker.node(mesh=7)


def negative_reference(maker: Maker) -> None:
    maker.triangle()
    maker.json["nodes"][0]["mesh"] = -1


def wrong_types(maker: Maker) -> None:
    maker.triangle()
    maker.json["nodes"][0]["translation"] = "up"


def infinite_transform(maker: Maker) -> None:
    maker.triangle()
    maker.json["nodes"][0]["scale"] = [1e308, 1e308, 10]
    maker.json["nodes"][0]["rotation"] = [0.5, 0.5, 0.5, -1e308]
    maker.json["nodes"][0]["children"] = [maker.node(root=False, mesh=0, scale=[1e308, 1, 1])]


def far_away(maker: Maker) -> None:
    maker.triangle()
    maker.json["nodes"][0]["translation"] = [0, 1e30, 0]


def required_extension(maker: Maker) -> None:
    maker.triangle()
    maker.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]


def empty(maker: Maker) -> None:
    maker.node()


def only_degenerate(maker: Maker) -> None:
    maker.triangle(indices=np.array([0, 1, 1], "<u2"))


def old_version(maker: Maker) -> None:
    maker.triangle()
    maker.json["asset"]["version"] = "1.0"


CASES = {
    "not a finite number": bad_position,
    "outside its 3 vertices": index_out_of_range,
    "claims 1099511627776": huge_count,
    "claims 1099511627776 ": huge_count_without_view,
    "past the end of its bufferView": count_past_view,
    "past the end of its bufferView ": negative_offset,
    "past the end of its buffer": view_past_buffer,
    "no tree": cycle,
    "no tree ": two_parents,
    "cycle": cycle_without_scenes,
    "'absent.bin', which is missing": missing_buffer,
    "outside its own folder": traversal,
    "outside its own folder ": absolute_path,
    "outside its own folder  ": remote,
    "cannot be decoded": bad_image(None),
    "'gone.png', which is missing": bad_image("gone.png"),
    "outside its own folder   ": bad_image("../../x.png"),
    "meshes[7]": missing_mesh,
    "meshes[-1]": negative_reference,
    "does not follow the glTF 2.0 format": wrong_types,
    "too far from the origin": infinite_transform,
    "too far from the origin ": far_away,
    "KHR_draco_mesh_compression": required_extension,
    "no triangles": empty,
    "no triangles ": only_degenerate,
    "version 1.0": old_version,
}


@pytest.mark.parametrize("says", CASES)
def test_one_sentence_names_file_and_fault(tmp_path: Path, says: str) -> None:
    maker = Maker()
    CASES[says](maker)
    path = maker.write(tmp_path / "bad.gltf")
    with pytest.raises(UserError) as error:
        load_scene(path)
    message = str(error.value)
    assert says.strip() in message
    assert str(path) in message
    assert "\n" not in message
    assert error.value.exit_code == 2


def test_traversal_does_not_read_an_existing_file(tmp_path: Path) -> None:
    (tmp_path / "secret.bin").write_bytes(CORNERS.tobytes())
    (tmp_path / "inner").mkdir()
    maker = Maker()
    traversal(maker)
    with pytest.raises(UserError, match="outside its own folder"):
        load_scene(maker.write(tmp_path / "inner" / "bad.gltf"))


def test_every_truncation_of_a_glb_is_refused(tmp_path: Path) -> None:
    maker = Maker()
    maker.triangle(TEXCOORD_0=maker.accessor(CORNERS[:, :2]))
    whole = maker.write(tmp_path / "whole.glb").read_bytes()
    cut = tmp_path / "cut.glb"
    for length in range(0, len(whole) - 1, 7):
        cut.write_bytes(whole[:length])
        with pytest.raises(UserError):
            load_scene(cut)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_json_value_anywhere_is_accepted_or_refused_politely(tmp_path: Path, data: st.DataObject) -> None:
    maker = Maker()
    maker.triangle(indices=np.array([0, 1, 2], "<u2"), material=maker.add("materials", {"name": "x"}))
    document = json.loads(maker.write(tmp_path / "fuzz.gltf").read_text())
    spots = list(_spots(document))
    holder, key = data.draw(st.sampled_from(spots))
    odd = st.one_of(
        st.none(),
        st.booleans(),
        st.integers(-(2**70), 2**70),
        st.floats(allow_nan=False, allow_infinity=False),
        st.text(max_size=4),
        st.lists(st.integers(-3, 3), max_size=3),
        st.dictionaries(st.text(max_size=3), st.none(), max_size=2),
    )
    holder[key] = data.draw(odd)
    path = tmp_path / "fuzz.gltf"
    path.write_text(json.dumps(document))
    try:
        scene = load_scene(path)
    except UserError as error:
        assert str(path) in str(error)  # noqa: PT017 (either outcome is fine, so pytest.raises does not fit)
    else:
        assert np.isfinite(scene.meshes[0].positions).all()


def _spots(value: object) -> object:
    """Every (container, key) of a JSON document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield value, key
        yield from _spots(inner)


def test_unknown_name_lists_the_built_in_scenes() -> None:
    with pytest.raises(UserError, match="still-life"):
        load_scene("no-such-scene")


def test_missing_file_and_folder(tmp_path: Path) -> None:
    (tmp_path / "folder.glb").mkdir()
    for name, told in (("absent.glb", "does not exist or is no file"), ("folder.glb", "folder.glb is a folder")):
        with pytest.raises(UserError, match=told):
            load_scene(tmp_path / name)
