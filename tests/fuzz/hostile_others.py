"""Hostile OBJ, PLY and STL."""

from __future__ import annotations

import struct

import numpy as np

from .cases import Case, alone
from .hostile_images import SMALL, black_png, text_bomb
from .seeds import SQUARE

V3 = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TRIANGLE = V3 + b"f 1 2 3\n"


def _obj(text: bytes, **beside: bytes) -> Case:
    return lambda: {"model.obj": text, **{name.replace("_", "."): data for name, data in beside.items()}}


def _library(name: bytes) -> Case:
    return _obj(b"mtllib " + name + b"\nusemtl a\n" + TRIANGLE, model_mtl=b"newmtl a\nKd 1 0 0\n")


def _mtl(text: bytes, **beside: bytes) -> Case:
    uvs = b"vt 0 0\nvt 1 0\nvt 0 1\n"
    model = b"mtllib model.mtl\nusemtl a\n" + V3 + uvs + b"f 1/1 2/2 3/3\n"
    return _obj(model, model_mtl=b"newmtl a\n" + text, **beside)


def _picture(data: bytes) -> Case:
    return _mtl(b"map_Kd t.png\n", t_png=data)


def _ply(header: str, body: bytes = b"") -> Case:
    return alone("model.ply", f"ply\nformat {header}end_header\n".encode() + body)


def _counted(vertices: str, faces: str, kind: str = "ascii") -> Case:
    """Three vertices and a face, with other numbers of them in the header."""
    xyz = "".join(f"property float {axis}\n" for axis in "xyz")
    lists = "property list uchar int vertex_indices\n"
    text = b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    if kind != "ascii":
        text = SQUARE[:3].astype("<f4").tobytes() + struct.pack("<B3i", 3, 0, 1, 2)
    return _ply(f"{kind} 1.0\nelement vertex {vertices}\n{xyz}element face {faces}\n{lists}", text)


def _faces(rows: bytes) -> Case:
    xyz = "property float x\nproperty float y\nproperty float z\n"
    lists = "property list uchar int vertex_indices\n"
    count = rows.count(b"\n")
    return _ply(f"ascii 1.0\nelement vertex 3\n{xyz}element face {count}\n{lists}", b"0 0 0\n1 0 0\n0 1 0\n" + rows)


def _properties(text: str, body: bytes = b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n") -> Case:
    return _ply(f"ascii 1.0\nelement vertex 3\n{text}element face 1\nproperty list uchar int vertex_indices\n", body)


def _stl(count: int, triangles: np.ndarray) -> Case:
    faces = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    faces["corners"] = triangles
    return alone("model.stl", b"\0" * 80 + struct.pack("<I", count) + faces.tobytes())


_ONE = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], "<f4")
_FLOATS = "property float x\nproperty float y\nproperty float z\n"

CASES: dict[str, Case] = {
    "obj: nothing": _obj(b""),
    "obj: comments": _obj(b"# nothing\n" * 10),
    "obj: points and lines": _obj(V3 + b"p 1\nl 1 2 3\n"),
    "obj: vertices alone": _obj(V3),
    "obj: a face of one corner": _obj(V3 + b"f 1\n"),
    "obj: a face of two corners": _obj(V3 + b"f 1 2\n"),
    "obj: faces of one and of three corners": _obj(TRIANGLE + b"f 1\n"),
    "obj: a face of twenty thousand corners": _obj(V3 + b"f" + b" 1 2 3" * 6667 + b"\n"),
    "obj: index zero": _obj(V3 + b"f 0 1 2\n"),
    "obj: index far back": _obj(V3 + b"f -9 -2 -1\n"),
    "obj: index of 2^63": _obj(V3 + b"f 9223372036854775808 1 2\n"),
    "obj: index of 10^30": _obj(V3 + b"f 1000000000000000000000000000000 1 2\n"),
    "obj: no texture coordinate": _obj(V3 + b"f 1/9 2/9 3/9\n"),
    "obj: texture coordinates of one number": _obj(V3 + b"vt 0\nvt 1\nvt 0\nf 1/1 2/2 3/3\n"),
    "obj: texture coordinates huge": _obj(V3 + b"vt 1e300 0\nvt 1e38 0\nvt 0 1\nf 1/1 2/2 3/3\n"),
    "obj: vertices of two numbers": _obj(b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n"),
    "obj: vertices of seven numbers": _obj(b"v 0 0 0 1 1e300 nan 1\nv 1 0 0 1 1 1 1\nv 0 1 0 1 1 1 1\nf 1 2 3\n"),
    "obj: vertices infinite": _obj(b"v inf 0 0\n" + V3 + b"f 1 2 3\n"),
    "obj: vertices huge": _obj(b"v 1e39 0 0\n" + V3 + b"f 1 2 3\n"),
    "obj: normals nan": _obj(V3 + b"vn nan nan nan\nf 1//1 2//1 3//1\n"),
    "obj: a line of a million letters": _obj(b"g " + b"a" * 1_000_000 + b"\n" + TRIANGLE),
    "obj: a line that goes on": _obj(V3 + b"f 1 2 \\\n3\n"),
    "obj: three hundred materials": _obj(TRIANGLE + b"".join(b"usemtl m%d\nf 1 2 3\n" % i for i in range(300))),
    "obj: names of control characters": _obj(b"o \x1b[31m\x07\nusemtl \x08\n" + TRIANGLE),
    "obj: gzip": _obj(b"\x1f\x8b\x08" + b"\0" * 60),
    "obj: library outside": _library(b"../../../etc/passwd"),
    "obj: library at the root": _library(b"/model.mtl"),
    "obj: library absolute": _library(b"/etc/passwd"),
    "obj: library with nul": _library(b"a\0b"),
    "obj: library of five thousand letters": _library(b"a" * 5000),
    "obj: library that is the folder": _library(b"."),
    "obj: library of no name": _library(b""),
    "obj: library that is the model": _library(b"model.obj"),
    "obj: library missing": _library(b"gone.mtl"),
    "obj: material of nothing": _mtl(b"Kd\nKe\nNs\nd\nmap_Kd\n"),
    "obj: material of nan": _mtl(b"Kd nan 1 1\nKe inf 0 0\nNs -1e300\nd nan\n"),
    "obj: material huge": _mtl(b"Kd 1e300 1 1\nKe 1e300 0 0\nNs 1e300\nd 1e300\n"),
    "obj: material negative": _mtl(b"Kd -1 -1 -1\nKe -1 -1 -1\nNs -2\nd -1\n"),
    "obj: material of one number": _mtl(b"Kd 1\nKe 1\n"),
    "obj: picture": _picture(SMALL),
    "obj: picture of 60000x60000": _picture(black_png(60_000, 60_000, rows=1)),
    "obj: picture of 13000x13000": _picture(black_png(13_000, 13_000)),
    "obj: picture cut short": _picture(SMALL[:40]),
    "obj: picture of text": _picture(b"not a picture"),
    "obj: picture with a comment of 100 MB": _picture(text_bomb()),
    "obj: picture in PostScript": _picture(
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n"
    ),
    "obj: picture outside": _mtl(b"map_Kd ../../../etc/passwd\n"),
    "obj: picture with nul": _mtl(b"map_Kd a\0b\n"),
    "obj: picture of five thousand letters": _mtl(b"map_Kd " + b"a" * 5000 + b"\n"),
    "obj: picture with options": _mtl(b"map_Kd -s 1 1 1 t.png\n", t_png=SMALL),
    "ply: nothing": alone("model.ply", b""),
    "ply: a header without end": alone("model.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n"),
    "ply: a header of one line": alone("model.ply", b"ply " * 100_000),
    "ply: no format": alone("model.ply", b"ply\nelement vertex 3\nend_header\n"),
    "ply: no vertices": _ply("ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n", b"3 0 1 2\n"),
    "ply: only edges": _properties(_FLOATS, b"0 0 0\n1 0 0\n0 1 0\n"),
    "ply: vertices 10^12": _counted("1000000000000", "1"),
    "ply: vertices 10^12 binary": _counted("1000000000000", "1", "binary_little_endian"),
    "ply: vertices 10^8": _counted("100000000", "1"),
    "ply: vertices 10^8 binary": _counted("100000000", "1", "binary_little_endian"),
    "ply: faces 10^8": _counted("3", "100000000"),
    "ply: faces 10^8 binary": _counted("3", "100000000", "binary_little_endian"),
    "ply: vertices minus one": _counted("-1", "1"),
    "ply: vertices many": _counted("many", "1"),
    "ply: faces none": _counted("3", "0"),
    "ply: a face of none": _faces(b"0\n"),
    "ply: a face of one": _faces(b"1 0\n"),
    "ply: a face of two": _faces(b"2 0 1\n"),
    "ply: a face of nine": _faces(b"9 0 1 2 0 1 2 0 1 2\n"),
    "ply: a face out of range": _faces(b"3 0 1 9\n"),
    "ply: a face below zero": _faces(b"3 0 1 -1\n"),
    "ply: faces of three and four": _faces(b"3 0 1 2\n4 0 1 2 0\n"),
    "ply: faces that lie": _faces(b"200 0 1 2\n"),
    "ply: no z": _properties("property float x\nproperty float y\n", b"0 0\n1 0\n0 1\n3 0 1 2\n"),
    "ply: x is a list": _properties("property list uchar float x\nproperty float y\nproperty float z\n"),
    "ply: x twice": _properties("property float x\n" + _FLOATS),
    "ply: a type unknown": _properties("property quad x\nproperty float y\nproperty float z\n"),
    "ply: doubles beyond floats": _properties(
        _FLOATS.replace("float", "double"), b"1e300 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    ),
    "ply: nan": _properties(_FLOATS, b"nan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
    "ply: a texture outside": alone(
        "model.ply", b"ply\nformat ascii 1.0\ncomment TextureFile ../../etc/passwd\nend_header\n"
    ),
    "stl: nothing": alone("model.stl", b""),
    "stl: a header": alone("model.stl", b"\0" * 84),
    "stl: solid and nothing": alone("model.stl", b"solid a\nendsolid a\n"),
    "stl: half a facet": alone("model.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
    "stl: one triangle": _stl(1, _ONE),
    "stl: more than there are": _stl(2, _ONE),
    "stl: 2^32 triangles": _stl(2**32 - 1, _ONE),
    "stl: fewer than there are": _stl(0, _ONE),
    "stl: nan": _stl(1, _ONE * np.float32("nan")),
    "stl: infinite": _stl(1, _ONE + np.float32("inf")),
    "stl: huge": _stl(1, _ONE * np.float32(3e38)),
    "stl: no area": _stl(1, _ONE * 0),
}
