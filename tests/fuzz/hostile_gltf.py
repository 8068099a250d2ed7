"""Hostile glTF: containers, JSON, references, accessors, the node graph."""

from __future__ import annotations

import gzip
import io
import json
import struct
import zipfile
from typing import Any

import numpy as np

from tests.cpu.gltf_maker import CORNERS, Maker

from .cases import Case, alone, document, gltf
from .seeds import SQUARE, Files, seed

PLAIN = {"asset": {"version": "2.0"}}
FLAT = np.zeros((1, 3), "<f4")


def _with_uri(uri: str) -> Case:
    def bend(maker: Maker) -> None:
        maker.triangle()
        maker.json["buffers"] = [{"byteLength": 36, "uri": uri}]

    return gltf(bend, model_bin=CORNERS.tobytes())


def _with_node(**content: Any) -> Case:
    """A triangle's node with more in it."""

    def bend(maker: Maker) -> None:
        node = maker.triangle()
        maker.json["nodes"][node].update(content)

    return gltf(bend)


def _with_attribute(name: str, values: Any) -> Case:
    return gltf(lambda maker: maker.triangle(**{name: maker.accessor(np.asarray(values, "<f4"))}))


def _with_indices(*values: int, kind: str = "<u4") -> Case:
    return gltf(lambda maker: maker.triangle(indices=np.array(values, kind)))


def _with_accessor(**content: Any) -> Case:
    def bend(maker: Maker) -> None:
        maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(SQUARE, **content))))

    return gltf(bend)


def _with_view(**content: Any) -> Case:
    def bend(maker: Maker) -> None:
        maker.triangle()
        maker.json["bufferViews"][0].update(content)

    return gltf(bend)


def _zeros(count: int) -> Case:
    """Accessors without a view hold zeros, as many as they say."""

    def bend(maker: Maker) -> None:
        accessor = maker.add("accessors", {"componentType": 5126, "count": count, "type": "VEC3"})
        maker.node(mesh=maker.mesh(maker.primitive(accessor)))

    return gltf(bend)


def _mode(mode: int) -> Case:
    return gltf(lambda maker: maker.triangle(mode=mode))


def _many_of_one(primitives: int, vertices: int) -> Case:
    """A mesh that reads the same vertices again and again."""

    def bend(maker: Maker) -> None:
        places = np.random.default_rng(1).random((vertices, 3), np.float32)
        primitive = maker.primitive(maker.accessor(places))
        maker.node(mesh=maker.mesh(*[primitive] * primitives))

    return gltf(bend)


def _many_placed(nodes: int, triangles: int, indexed: bool) -> Case:
    def bend(maker: Maker) -> None:
        places = np.random.default_rng(1).random((3 * triangles, 3), np.float32)[: 99 if indexed else None]
        indices = (np.arange(3 * triangles) % 99).astype("<u2") if indexed else None
        mesh = maker.mesh(maker.primitive(maker.accessor(places), indices))
        for _ in range(nodes):
            maker.node(mesh=mesh)

    return gltf(bend)


def _chain(count: int, **content: Any) -> Case:
    """Nodes one below another, a triangle at the end."""

    def bend(maker: Maker) -> None:
        maker.triangle()
        maker.json["nodes"] = [{"children": [i + 1], **content} for i in range(count)] + maker.json["nodes"]

    return gltf(bend)


def _squashed(maker: Maker) -> None:
    """An octahedron with smooth normals, pressed flat: at its rim no normal is left."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], "<f4")
    faces = [(x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    normals = maker.accessor(points)
    corners = np.array(faces, "<u2").ravel()
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(points), corners, NORMAL=normals)), scale=[1, 0, 1])


def _sparse(indices: Any, kind: str = "<u2", **content: Any) -> Case:
    def bend(maker: Maker) -> None:
        at = {
            "bufferView": maker.view(np.asarray(indices, kind).tobytes()),
            "componentType": {"<u2": 5123, "i1": 5120}[kind],
        }
        values = {"bufferView": maker.view(SQUARE[: len(indices)].tobytes())}
        sparse = {"count": len(indices), "indices": at, "values": values, **content}
        maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(SQUARE, sparse=sparse))))

    return gltf(bend)


def _glb_with(**patches: bytes) -> Case:
    """The seed with bytes put at offsets: `at_8=...`."""

    def files() -> Files:
        data = bytearray(seed("glb")["model.glb"])
        for place, patch in patches.items():
            at = int(place.removeprefix("at_"))
            data[at : at + len(patch)] = patch
        return {"model.glb": bytes(data)}

    return files


def _two_json_chunks() -> bytes:
    text = json.dumps(PLAIN).encode().ljust(28)
    chunk = struct.pack("<I4s", len(text), b"JSON") + text
    return struct.pack("<4sII", b"glTF", 2, 12 + 2 * len(chunk)) + 2 * chunk


def _zip_bomb() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("model.gltf", b"0" * 5_000_000)
    return out.getvalue()


def _text(text: str, coding: str = "utf-8") -> Case:
    return alone("model.gltf", text.encode(coding))


_HEAD = json.dumps(PLAIN)[:-1]

CASES: dict[str, Case] = {
    "an empty file": alone("model.glb", b""),
    "an empty object": _text("{}"),
    "an array at the top": _text("[]"),
    "a number at the top": _text("2.0"),
    "brackets a hundred thousand deep": _text("[" * 100_000),
    "objects fifty thousand deep": _text('{"a":' * 50_000 + "1" + "}" * 50_000),
    "extras nine hundred deep": _text(_HEAD + ', "extras": ' + "[" * 900 + "]" * 900 + "}"),
    "a key twice": _text(_HEAD + ', "nodes": [], "nodes": 5, "scenes": [{"nodes": [0]}]}'),
    "a key of a million letters": _text(_HEAD + ', "' + "k" * 1_000_000 + '": 1}'),
    "a version of a million letters": _text('{"asset": {"version": "' + "3" * 1_000_000 + '"}}'),
    "a number of a million digits": _text(_HEAD + ', "scene": ' + "1" * 1_000_000 + "}"),
    "text in utf-16": _text(json.dumps(PLAIN), "utf-16"),
    "text in latin-1": _text(_HEAD + ', "extras": "caf\u00e9"}', "latin-1"),
    "gzip": alone("model.glb", lambda: gzip.compress(b"0" * 5_000_000)),
    "a zip bomb": alone("model.glb", _zip_bomb),
    "a zip bomb called gltf": alone("model.gltf", _zip_bomb),
    "a chunk of four gigabytes": _glb_with(at_12=b"\xff" * 4),
    "a length of four gigabytes": _glb_with(at_8=b"\xff" * 4),
    "a length of zero": _glb_with(at_8=b"\0" * 4),
    "version one": _glb_with(at_4=b"\1\0\0\0"),
    "two json chunks": alone("model.glb", _two_json_chunks),
    "no scenes": document(),
    "an empty scene": document(scenes=[{}]),
    "a scene that is not there": document(scenes=[{}], scene=1),
    "scenes but no nodes": document(scenes=[{"nodes": [0]}]),
    "a root twice": gltf(lambda m: m.json["scenes"][0]["nodes"].append(m.triangle())),
    "a node below itself": _with_node(children=[0]),
    "a cycle of two": gltf(
        lambda m: m.json.update(nodes=[{"children": [1]}, {"children": [0]}], scenes=[{"nodes": [0]}])
    ),
    "a cycle without scenes": document(nodes=[{"children": [1]}, {"children": [2]}, {"children": [1]}]),
    "five thousand nodes deep": _chain(5000),
    "five thousand nodes that double": _chain(5000, scale=[2, 2, 2]),
    "five thousand nodes that halve": _chain(5000, scale=[0.5, 0.5, 0.5]),
    "only points": _mode(0),
    "only lines": _mode(1),
    "only a loop": _mode(2),
    "only a strip of lines": _mode(3),
    "a strip": _mode(5),
    "a fan": _mode(6),
    "mode 7": _mode(7),
    "a mesh without primitives": gltf(lambda m: m.node(mesh=m.mesh())),
    "a primitive without attributes": gltf(lambda m: m.node(mesh=m.mesh({"attributes": {}}))),
    "a required extension": gltf(
        lambda m: m.json.update(extensionsRequired=["EXT_" + "x" * 9000] * m.triangle() + ["A\nB"])
    ),
    "meshopt": _with_view(extensions={"EXT_meshopt_compression": {}}),
    "uri: traversal": _with_uri("../../etc/passwd"),
    "uri: traversal inside": _with_uri("a/../../model.bin"),
    "uri: absolute": _with_uri("/etc/passwd"),
    "uri: file scheme": _with_uri("file:///etc/passwd"),
    "uri: encoded": _with_uri("%2e%2e%2f%2e%2e%2fetc%2fpasswd"),
    "uri: encoded twice": _with_uri("%252e%252e%252fetc%252fpasswd"),
    "uri: backslashes": _with_uri("..\\..\\etc\\passwd"),
    "uri: a drive": _with_uri("C:/windows/win.ini"),
    "uri: a share": _with_uri("\\\\server\\share"),
    "uri: http": _with_uri("http://example.org/a.bin"),
    "uri: nul": _with_uri("model.bin\0.png"),
    "uri: five thousand letters": _with_uri("a" * 5000),
    "uri: a thousand folders": _with_uri("a/" * 1000 + "b"),
    "uri: nothing": _with_uri(""),
    "uri: its folder": _with_uri("."),
    "uri: itself": _with_uri("model.gltf"),
    "uri: a lone surrogate": _with_uri("\ud800"),
    "uri: data without comma": _with_uri("data:application/octet-stream;base64"),
    "uri: data not base64": _with_uri("data:,abc"),
    "uri: data too short": _with_uri("data:;base64,AAAA"),
    "zeros, thirty million": _zeros(30_000_000),
    "zeros, three": _zeros(3),
    "vertices read two thousand times": _many_of_one(2000, 60_000),
    "fifty-one million triangles placed": _many_placed(850, 60_000, True),
    "a hundred million vertices placed": _many_placed(1000, 33_000, False),
    "offset one": _with_accessor(byteOffset=1),
    "offset minus one": _with_accessor(byteOffset=-1),
    "offset huge": _with_accessor(byteOffset=2**62),
    "count minus one": _with_accessor(count=-1),
    "count zero": _with_accessor(count=0),
    "count huge": _with_accessor(count=2**40),
    "component int": _with_accessor(componentType=5124),
    "component double": _with_accessor(componentType=5130),
    "component ushort": _with_accessor(componentType=5123),
    "type MAT4": _with_accessor(type="MAT4"),
    "stride three": _with_view(byteStride=3),
    "stride minus twelve": _with_view(byteStride=-12),
    "stride huge": _with_view(byteStride=2**62),
    "view of minus one byte": _with_view(byteLength=-1),
    "view past the end": _with_view(byteOffset=2**62),
    "indices wrap": _with_indices(0, 1, 2, 0xFFFFFFFF, 1, 2),
    "indices wrap in 16 bits": _with_indices(0, 1, 0xFFFF, kind="<u2"),
    "indices negative": _with_indices(0, 1, -1, kind="i1"),
    "indices of four": _with_indices(0, 1, 2, 0),
    "indices of one triangle thrice": _with_indices(*[0, 1, 2] * 3),
    "indices that are floats": gltf(lambda m: m.node(mesh=m.mesh(m.primitive(m.accessor(SQUARE), CORNERS[:, 0])))),
    "normals nan": _with_attribute("NORMAL", CORNERS * np.nan),
    "normals infinite": _with_attribute("NORMAL", CORNERS + np.inf),
    "normals zero": _with_attribute("NORMAL", CORNERS * 0),
    "normals huge": _with_attribute("NORMAL", CORNERS + 3e38),
    "normals too few": _with_attribute("NORMAL", CORNERS[:2]),
    "uvs nan": _with_attribute("TEXCOORD_0", CORNERS[:, :2] * np.nan),
    "uvs huge": _with_attribute("TEXCOORD_0", CORNERS[:, :2] + 3e38),
    "tangents nan": _with_attribute("TANGENT", np.full((3, 4), np.nan)),
    "colours nan": _with_attribute("COLOR_0", np.full((3, 4), np.nan)),
    "colours infinite": _with_attribute("COLOR_0", np.full((3, 3), np.inf)),
    "positions huge": gltf(lambda m: m.node(mesh=m.mesh(m.primitive(m.accessor(CORNERS * 3e38))))),
    "positions denormal": gltf(lambda m: m.node(mesh=m.mesh(m.primitive(m.accessor(CORNERS * np.float32(1e-42)))))),
    "sparse out of range": _sparse([1, 9]),
    "sparse unsorted": _sparse([3, 1]),
    "sparse twice": _sparse([1, 1]),
    "sparse signed": _sparse([1, -1], "i1"),
    "sparse count huge": _sparse([1, 3], count=2**40),
    "sparse count negative": _sparse([1, 3], count=-1),
    "sparse without values": _sparse([1, 3], values={}),
    "a matrix of zeros": _with_node(matrix=[0] * 15 + [1]),
    "a matrix of ones": _with_node(matrix=[1] * 16),
    "a matrix without inverse": _with_node(matrix=[1, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
    "a scale of zero": _with_node(scale=[0, 0, 0]),
    "a scale of zero along z": _with_node(scale=[1, 1, 0]),
    "a scale that underflows": _with_node(scale=[1e-200, 1e-200, 1e-200]),
    "a scale huge where nothing is": _with_node(scale=[1, 1, 1e308]),
    "a mirror": _with_node(scale=[-1, 1, 1]),
    "a quaternion of zeros": _with_node(rotation=[0, 0, 0, 0]),
    "a quaternion huge": _with_node(rotation=[1e308, 1e308, 0, 0]),
    "a quaternion tiny": _with_node(rotation=[1e-320, 0, 0, 0]),
    "a translation huge": _with_node(translation=[1e308, 0, 0]),
    "a translation to the limit": _with_node(translation=[9.9e8, 0, 0]),
    "pressed flat": gltf(_squashed),
}
