"""The valid files that the corpus bends: small, and between them with every feature that the loaders read."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tests.cpu.gltf_maker import CORNERS, Maker, png

Files = dict[str, bytes]  # by name relative to a folder; the first is the model, the others lie beside it

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.25]], "<f4")
CORNERS_OF_SQUARE = np.array([0, 1, 2, 0, 2, 3])
_CHECKER = png(np.indices((4, 4)).sum(0)[..., None].repeat(4, 2).astype(np.uint8) % 2 * 255)
_GREY = png(np.full((2, 3, 3), 128, np.uint8))


def _document() -> Maker:
    """A node tree of two textured meshes, lit, animated and seen by a camera."""
    maker = Maker()
    _materials(maker)
    square = maker.mesh(_textured_square(maker), _interleaved(maker))
    strip = maker.mesh(maker.primitive(_sparse(maker), np.arange(4, dtype="u1"), mode=5, COLOR_0=_colors(maker)))
    maker.json["extensionsUsed"] = ["KHR_lights_punctual", "KHR_texture_transform"]
    maker.json["extensions"] = {"KHR_lights_punctual": {"lights": _LIGHTS}}
    maker.add("cameras", {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}, "extras": _LENS})
    leaf = maker.node(root=False, mesh=strip, rotation=[0, 0.6, 0, 0.8], scale=[1, 2, 1], name="leaf")
    lamp = {"KHR_lights_punctual": {"light": 1}}
    bulb = maker.node(root=False, translation=[0, 2, 0], extensions=lamp)
    maker.node(mesh=square, translation=[1, 0, -1], children=[leaf, bulb], name="branch")
    maker.node(camera=0, matrix=np.eye(4).ravel().tolist())
    for light in (0, 2):
        maker.node(extensions={"KHR_lights_punctual": {"light": light}})
    _animation(maker, leaf)
    maker.json["scenes"][0]["extras"] = {"environment": {"sky": [0.1, 0.2, 0.3], "ground": [0, 0, 0]}}
    return maker


_LENS = {"focus_distance": 2.0, "aperture": 0.05}
_LIGHTS = [
    {"type": "directional", "color": [1, 0.9, 0.8], "intensity": 3.0},
    {"type": "point", "intensity": 20.0, "range": 4.0},
    {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}},
]


def _materials(maker: Maker) -> None:
    images = [
        maker.add("images", {"bufferView": maker.view(data), "mimeType": "image/png"}) for data in (_CHECKER, _GREY)
    ]
    sampler = maker.add("samplers", {"wrapS": 33071, "wrapT": 33648, "magFilter": 9729})
    color, data = (maker.add("textures", {"source": image, "sampler": sampler}) for image in images)
    moved = {"KHR_texture_transform": {"offset": [0.5, 0], "rotation": 0.3, "scale": [2, 2], "texCoord": 0}}
    maker.add(
        "materials",
        {
            "name": "painted",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.8, 0.7, 0.6, 1],
                "baseColorTexture": {"index": color, "extensions": moved},
                "metallicFactor": 0.2,
                "roughnessFactor": 0.7,
                "metallicRoughnessTexture": {"index": data},
            },
            "normalTexture": {"index": data, "scale": 0.5},
            "emissiveFactor": [0, 0.5, 1],
            "emissiveTexture": {"index": color},
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 5}},
            "alphaMode": "MASK",
            "alphaCutoff": 0.4,
        },
    )
    old = {"diffuseFactor": [1, 0, 0, 1], "glossinessFactor": 0.2}
    maker.add("materials", {"extensions": {"KHR_materials_pbrSpecularGlossiness": old}})


def _textured_square(maker: Maker) -> dict[str, Any]:
    normals = np.tile(np.array([0, 0, 1], "<f4"), (4, 1))
    return maker.primitive(
        maker.accessor(SQUARE, min=[0, 0, 0], max=[1, 1, 0.25]),
        CORNERS_OF_SQUARE.astype("<u2"),
        material=0,
        NORMAL=maker.accessor(normals),
        TEXCOORD_0=maker.accessor((SQUARE[:, :2] * 65535).astype("<u2"), normalized=True),
        TANGENT=maker.accessor(np.tile(np.array([1, 0, 0, 1], "<f4"), (4, 1))),
    )


def _interleaved(maker: Maker) -> dict[str, Any]:
    """Positions and normals in one bufferView with a stride."""
    rows = np.hstack([SQUARE + np.float32(1), np.tile(np.array([0, 0, 1], "<f4"), (4, 1))])
    view = maker.view(rows.tobytes(), byteStride=24)
    common = {"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3"}
    positions, normals = (maker.add("accessors", {**common, "byteOffset": at}) for at in (0, 12))
    return maker.primitive(positions, CORNERS_OF_SQUARE.astype("<u4"), material=1, NORMAL=normals)


def _sparse(maker: Maker) -> int:
    """Positions of which two are replaced."""
    at, new = maker.view(np.array([1, 3], "<u2").tobytes()), maker.view(SQUARE[[1, 3]].tobytes())
    indices, values = {"bufferView": at, "componentType": 5123}, {"bufferView": new}
    return maker.accessor(SQUARE, sparse={"count": 2, "indices": indices, "values": values})


def _colors(maker: Maker) -> int:
    return maker.accessor(
        np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [9, 9, 9, 255]], "u1"), normalized=True
    )


def _animation(maker: Maker, node: int) -> None:
    times = maker.accessor(np.array([0, 0.5, 2], "<f4"))
    slide = maker.accessor(np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0]], "<f4"))
    turn = maker.accessor(np.tile(np.array([0, 0, 0, 1], "<f4"), (9, 1)))
    samplers = [
        {"input": times, "output": slide, "interpolation": "STEP"},
        {"input": times, "output": turn, "interpolation": "CUBICSPLINE"},
    ]
    paths = ("translation", "rotation")
    channels = [{"sampler": i, "target": {"node": node, "path": path}} for i, path in enumerate(paths)]
    maker.add("animations", {"samplers": samplers, "channels": channels})


def _glb() -> Files:
    with TemporaryDirectory() as folder:
        return {"model.glb": _document().write(Path(folder) / "model.glb").read_bytes()}


def _gltf() -> Files:
    """The same with its buffer in a file, an image in another, a second buffer and the other image as data URIs."""
    maker = _document()
    document = maker.json
    document["images"] = [{"uri": "checker%20board.png"}, {"uri": DATA_PNG}]
    document["buffers"] = [{"byteLength": len(maker.blob), "uri": "model.bin"}, {"byteLength": 36, "uri": DATA_CORNERS}]
    view = maker.add("bufferViews", {"buffer": 1, "byteLength": 36})
    corners = maker.add("accessors", {"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3"})
    maker.node(mesh=maker.mesh(maker.primitive(corners, mode=6)))
    return {"model.gltf": json.dumps(document).encode(), "model.bin": maker.blob, "checker board.png": _CHECKER}


def _data_uri(kind: str, data: bytes) -> str:
    from base64 import b64encode

    return f"data:{kind};base64,{b64encode(data).decode()}"


DATA_PNG, DATA_CORNERS = _data_uri("image/png", _GREY), _data_uri("application/octet-stream", CORNERS.tobytes())

_OBJ = b"""# a square and a triangle
mtllib model.mtl
o square
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0.25
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
g front
usemtl painted
f 1/1/1 2/2/1 3/3/1 4/1/1
o triangle
usemtl plain
s off
f -4//1 -3//1 -1//1
l 1 2
p 3
"""
_MTL = b"""newmtl painted
Kd 0.1 0.2 0.3
Ke 1 2 3
Ns 126
d 1
map_Kd checker.png
newmtl plain
Kd 1 0 0
d 0.3
illum 2
"""
_VERTEX = ("x", "y", "z", "nx", "ny", "nz")


def _obj() -> Files:
    return {"model.obj": _OBJ, "model.mtl": _MTL, "checker.png": _CHECKER}


def _ply_header(kind: str) -> bytes:
    floats = "".join(f"property float {name}\n" for name in _VERTEX)
    colors = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    faces = "element face 2\nproperty list uchar int vertex_indices\n"
    return f"ply\nformat {kind} 1.0\ncomment made here\nelement vertex 4\n{floats}{colors}{faces}end_header\n".encode()


def _ply_ascii() -> Files:
    rows = [f"{x:g} {y:g} {z:g} 0 0 1 {40 * i} 200 90" for i, (x, y, z) in enumerate(SQUARE)]
    return {"model.ply": _ply_header("ascii") + "\n".join([*rows, "3 0 1 2", "3 0 2 3", ""]).encode()}


def _ply_binary(order: str) -> Files:
    kind = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    vertices = np.zeros(4, [(name, order + "f4") for name in _VERTEX] + [(name, "u1") for name in "rgb"])
    for axis, name in enumerate("xyz"):
        vertices[name] = SQUARE[:, axis]
    vertices["nz"], vertices["g"] = 1, 200
    faces = np.zeros(2, [("n", "u1"), ("v", order + "i4", 3)])
    faces["n"], faces["v"] = 3, CORNERS_OF_SQUARE.reshape(2, 3)
    return {"model.ply": _ply_header(kind) + vertices.tobytes() + faces.tobytes()}


def _stl_binary() -> Files:
    faces = np.zeros(2, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    faces["normal"], faces["corners"] = (0, 0, 1), SQUARE[CORNERS_OF_SQUARE.reshape(2, 3)]
    return {"model.stl": b"made here".ljust(80, b" ") + np.uint32(2).tobytes() + faces.tobytes()}


def _stl_ascii() -> Files:
    facets = ""
    for face in SQUARE[CORNERS_OF_SQUARE.reshape(2, 3)]:
        corners = "".join(f"   vertex {x:g} {y:g} {z:g}\n" for x, y, z in face)
        facets += f" facet normal 0 0 1\n  outer loop\n{corners}  endloop\n endfacet\n"
    return {"model.stl": f"solid made\n{facets}endsolid made\n".encode()}


_MAKERS: dict[str, Callable[[], Files]] = {
    "glb": _glb,
    "gltf": _gltf,
    "obj": _obj,
    "ply ascii": _ply_ascii,
    "ply little": lambda: _ply_binary("<"),
    "ply big": lambda: _ply_binary(">"),
    "stl binary": _stl_binary,
    "stl ascii": _stl_ascii,
}
SEEDS = tuple(_MAKERS)


@cache
def seed(name: str) -> Files:
    """The files of one valid model."""
    return _MAKERS[name]()
