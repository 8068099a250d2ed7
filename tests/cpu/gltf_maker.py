"""Small glTF documents for the tests of the loader: a triangle, and helpers to bend it."""

from __future__ import annotations

import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image

COMPONENT = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KIND = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")


class Maker:
    """A glTF document with one buffer, growing."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        self.blob = b""

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        self.json.setdefault(kind, []).append(entry)
        return len(self.json[kind]) - 1

    def view(self, data: bytes, **more: int) -> int:
        start = len(self.blob)
        self.blob += data + b"\0" * (-len(data) % 4)
        return self.add("bufferViews", {"buffer": 0, "byteOffset": start, "byteLength": len(data), **more})

    def accessor(self, array: np.ndarray, **more: Any) -> int:
        array = np.ascontiguousarray(array)
        width = 1 if array.ndim == 1 else array.shape[1]
        entry = {"bufferView": self.view(array.tobytes()), "componentType": COMPONENT[array.dtype.str[1:]]}
        return self.add("accessors", entry | {"count": len(array), "type": KIND[width], **more})

    def primitive(self, positions: int, indices: np.ndarray | None = None, **more: Any) -> dict[str, Any]:
        attributes = {"POSITION": positions} | {k: more.pop(k) for k in list(more) if k.isupper()}
        entry: dict[str, Any] = {"attributes": attributes, **more}
        if indices is not None:
            entry["indices"] = self.accessor(indices)
        return entry

    def mesh(self, *primitives: dict[str, Any]) -> int:
        return self.add("meshes", {"name": "m", "primitives": list(primitives)})

    def node(self, root: bool = True, **content: Any) -> int:
        index = self.add("nodes", content)
        if root:
            self.json["scenes"][0]["nodes"].append(index)
        return index

    def triangle(self, **more: Any) -> int:
        """A node that shows one triangle in the xy plane."""
        return self.node(mesh=self.mesh(self.primitive(self.accessor(CORNERS), **more)))

    def write(self, path: Path) -> Path:
        """As .glb or .gltf with a data URI, by the suffix."""
        buffer: dict[str, Any] = {"byteLength": len(self.blob)}
        if path.suffix == ".gltf":
            buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(self.blob).decode()
        if self.blob:
            self.json.setdefault("buffers", [buffer])
        text = json.dumps(self.json).encode()
        if path.suffix == ".gltf":
            path.write_bytes(text)
            return path
        text += b" " * (-len(text) % 4)
        total = 28 + len(text) + len(self.blob)
        parts = (struct.pack("<4sIII4s", b"glTF", 2, total, len(text), b"JSON"), text)
        path.write_bytes(b"".join(parts) + struct.pack("<I4s", len(self.blob), b"BIN\0") + self.blob)
        return path


def png(pixels: np.ndarray) -> bytes:
    """(h, w, 3 or 4) uint8 as PNG."""
    out = io.BytesIO()
    PIL.Image.fromarray(pixels).save(out, "PNG")
    return out.getvalue()
