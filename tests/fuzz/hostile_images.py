"""Hostile pictures, materials, lights and cameras of glTF."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from tests.cpu.gltf_maker import CORNERS, Maker, png

from .cases import Case, gltf

SMALL = png(np.zeros((2, 2, 3), np.uint8))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def black_png(width: int, height: int, rows: int | None = None, extra: bytes = b"") -> bytes:
    """A black picture of one bit a pixel, which deflates to a thousandth; only `rows` of its rows are there."""
    deflated = zlib.compress(bytes((width + 7) // 8 + 1) * (height if rows is None else rows), 9)
    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + extra + _chunk(b"IDAT", deflated) + _chunk(b"IEND", b"")


def text_bomb() -> bytes:
    """A PNG whose comment inflates to 100 MB."""
    return black_png(2, 2, extra=_chunk(b"zTXt", b"c\0\0" + zlib.compress(bytes(100_000_000), 9)))


def _pictured(*images: dict[str, Any], beside: dict[str, bytes] | None = None, **material: Any) -> Case:
    """A triangle that shows the first image; a material for each of the others."""

    def bend(maker: Maker) -> None:
        _with_images(maker, images)
        maker.json["materials"][0].update(material)

    return gltf(bend, **(beside or {}))


def _with_images(maker: Maker, images: Sequence[dict[str, Any]]) -> None:
    uvs = maker.accessor(CORNERS[:, :2].copy())
    for image in images:
        texture = maker.add("textures", {"source": maker.add("images", image)})
        material = maker.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}})
        maker.triangle(material=material, TEXCOORD_0=uvs)


def _inside(data: bytes, times: int = 1) -> Case:
    """Images that all lie in one bufferView."""

    def bend(maker: Maker) -> None:
        view = maker.view(data)
        _with_images(maker, [{"bufferView": view}] * times)

    return gltf(bend)


def _material(**content: Any) -> Case:
    return gltf(lambda maker: maker.triangle(material=maker.add("materials", content)))


def _pbr(**content: Any) -> Case:
    return _material(pbrMetallicRoughness=content)


def _moved(**transform: Any) -> Case:
    """A texture transform on a normal map, for which tangents are computed."""
    info = {"index": 0, "extensions": {"KHR_texture_transform": transform}}

    def bend(maker: Maker) -> None:
        _with_images(maker, [{"bufferView": maker.view(SMALL)}])
        maker.json["materials"][0]["normalTexture"] = info

    return gltf(bend)


def _light(node: dict[str, Any] | None = None, **content: Any) -> Case:
    def bend(maker: Maker) -> None:
        maker.triangle()
        maker.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "spot", **content}]}}
        maker.node(extensions={"KHR_lights_punctual": {"light": 0}}, **(node or {}))

    return gltf(bend)


def _camera(node: dict[str, Any] | None = None, kind: str = "perspective", extras: Any = None, **lens: Any) -> Case:
    def bend(maker: Maker) -> None:
        maker.triangle()
        camera = maker.add("cameras", {"type": kind, kind: {"yfov": 1.0, **lens}, "extras": extras})
        maker.node(camera=camera, **(node or {}))

    return gltf(bend)


FAR = {"translation": [1e300, 0, 0]}
STRONG = {"KHR_materials_emissive_strength": {"emissiveStrength": 1e300}}

CASES: dict[str, Case] = {
    "a picture of 60000x60000": _inside(black_png(60_000, 60_000, rows=1)),
    "a picture of 2^31 pixels a side": _inside(black_png(2**31 - 1, 2**31 - 1, rows=0)),
    "a picture of 16384x16384": _inside(black_png(16_384, 16_384)),
    "a picture of 13000x13000": _inside(black_png(13_000, 13_000)),
    "a picture of 16384x1": _inside(black_png(16_384, 1)),
    "five hundred pictures of 2048x2048": _inside(black_png(2048, 2048), 500),
    "a picture of no pixel": _inside(black_png(0, 0)),
    "a picture cut short": _inside(black_png(64, 64)[:60]),
    "a picture without rows": _inside(black_png(64, 64, rows=3)),
    "a picture with a comment of 100 MB": _inside(text_bomb()),
    "a picture in PostScript": _inside(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n"),
    "a picture in PDF": _inside(b"%PDF-1.4\n1 0 obj\n"),
    "a picture of nothing": _inside(b""),
    "a picture that is missing": _pictured({"uri": "gone.png"}),
    "a picture outside": _pictured({"uri": "../../../etc/passwd"}),
    "a picture outside, encoded": _pictured({"uri": "%2e%2e/%2e%2e/etc/passwd"}),
    "a picture that is the model": _pictured({"uri": "model.gltf"}),
    "a picture neither here nor there": _pictured({}),
    "a picture beside": _pictured({"uri": "t.png"}, beside={"t_png": SMALL}),
    "a name of control characters": _pictured({"uri": "t.png", "name": "a\nb\x1b[2J"}, beside={"t_png": SMALL[:20]}),
    "a cutoff of minus one": _pictured({"uri": "t.png"}, beside={"t_png": SMALL}, alphaMode="MASK", alphaCutoff=-1),
    "an unknown alpha mode": _pictured({"uri": "t.png"}, beside={"t_png": SMALL}, alphaMode="ADD"),
    "a cutoff huge": _material(alphaMode="MASK", alphaCutoff=1e300),
    "a colour huge": _pbr(baseColorFactor=[1e300, 1, 1, 1]),
    "a colour negative": _pbr(baseColorFactor=[-1, 1, 1, 1]),
    "a metal of 1e30": _pbr(metallicFactor=1e30),
    "a roughness of minus two": _pbr(roughnessFactor=-2),
    "a glow huge": _material(emissiveFactor=[1, 1, 1], extensions=STRONG),
    "a glow negative": _material(emissiveFactor=[-1, 0, 0]),
    "glossiness of 1e300": _material(extensions={"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 1e300}}),
    "a normal scale of 1e300": _material(normalTexture={"index": 0, "scale": 1e300}),
    "a texture scale of 1e300": _moved(scale=[1e300, 1e300]),
    "a texture scale of zero": _moved(scale=[0, 0]),
    "a texture scale of 1e-300": _moved(scale=[1e-300, 1e-300]),
    "a texture offset of 1e300": _moved(offset=[1e300, 0]),
    "a texture turned by 1e300": _moved(rotation=1e300),
    "a light of 1e300": _light(intensity=1e300),
    "a light of 1e38 times 1e38": _light(intensity=1e38, color=[1e38, 0, 0]),
    "a light that reaches 1e-300": _light(range=1e-300),
    "a light far away": _light(node=FAR),
    "a cone inside out": _light(spot={"innerConeAngle": 2, "outerConeAngle": 0.1}),
    "a cone of 1e300": _light(spot={"innerConeAngle": -1e300, "outerConeAngle": 1e300}),
    "a light pressed flat": _light(node={"scale": [0, 0, 0]}),
    "a camera far away": _camera(node=FAR),
    "a camera that sees nothing": _camera(yfov=1e-300),
    "a camera that sees all but": _camera(yfov=3.14159265358979),
    "a camera of pi": _camera(yfov=3.1415926535897931),
    "a camera focused on itself": _camera(node={"translation": [1e8, 0, 0]}, extras={"focus_distance": 1e-300}),
    "a camera focused at infinity": _camera(extras={"focus_distance": 1e300, "aperture": 1e300}),
    "a camera pressed flat": _camera(node={"scale": [0, 0, 0]}),
    "a camera of no kind": _camera(kind="orthographic"),
}
