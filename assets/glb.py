"""A tiny GLB writer: arrays and pixels in, the same bytes out every time."""

from __future__ import annotations

import json
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapes import Shape

_FLOAT, _U16, _U32 = 5126, 5123, 5125


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Encode (h, w, 3 or 4) uint8. Our own, because Pillow's filter choices and zlib change between its releases."""
    height, width, channels = pixels.shape
    rows = pixels.reshape(height, width * channels).astype(np.int16)
    left = np.zeros_like(rows)
    left[:, channels:] = rows[:, :-channels]
    filtered = np.empty((height, 1 + width * channels), np.uint8)
    filtered[:, 0] = 1  # filter type Sub on every row: smooth procedural textures shrink well under it
    filtered[:, 1:] = (rows - left) & 255
    header = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes(), 9)), (b"IEND", b""))
    body = (struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(body)


class GlbWriter:
    """Collects meshes, materials, textures and nodes; every `add` returns the glTF index."""

    def __init__(self, generator: str) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0", "generator": generator}}
        self.blob = bytearray()

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Append to a top-level array of the document."""
        self.json.setdefault(kind, []).append(entry)
        return len(self.json[kind]) - 1

    def view(self, data: bytes) -> int:
        """A bufferView holding `data`, aligned to four bytes."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)}
        self.blob += data
        return self.add("bufferViews", entry)

    def accessor(self, array: NDArray[Any], component: int, kind: str, limits: bool = False) -> int:
        """An accessor over a packed array; positions must state their limits."""
        entry = {
            "bufferView": self.view(array.tobytes()),
            "componentType": component,
            "count": len(array),
            "type": kind,
        }
        if limits:
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        return self.add("accessors", entry)

    def mesh(self, name: str, shape: Shape, material: int) -> int:
        """One mesh with one primitive."""
        short = len(shape.positions) <= 65535
        indices = shape.triangles.astype("<u2" if short else "<u4").ravel()
        attributes = {
            "POSITION": self.accessor(_rounded(shape.positions), _FLOAT, "VEC3", limits=True),
            "NORMAL": self.accessor(_rounded(shape.normals), _FLOAT, "VEC3"),
            "TEXCOORD_0": self.accessor(_rounded(shape.uvs), _FLOAT, "VEC2"),
        }
        faces = self.accessor(indices, _U16 if short else _U32, "SCALAR")
        primitive = {"attributes": attributes, "indices": faces, "material": material}
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def texture(self, name: str, pixels: NDArray[np.uint8], sampler: int) -> int:
        """An embedded PNG and the texture that reads it."""
        image = {"name": name, "mimeType": "image/png", "bufferView": self.view(png(pixels))}
        return self.add("textures", {"source": self.add("images", image), "sampler": sampler})

    def node(self, name: str, transform: NDArray[np.float64] | None = None, **content: Any) -> int:
        """A node; `transform` is row-major on column vectors, `content` whatever else glTF gives it."""
        entry: dict[str, Any] = {"name": name, **content}
        if transform is not None:
            entry["matrix"] = np.round(transform.T.ravel(), 7).tolist()
        return self.add("nodes", entry)

    def animate(
        self, node: int, path: str, times: NDArray[np.float64], values: NDArray[np.float64], method: str = "LINEAR"
    ) -> None:
        """Move a node given by translation or rotation through `values` at `times` [s], in the one animation."""
        if "animations" not in self.json:
            self.add("animations", {"name": "motion", "samplers": [], "channels": []})
        animation = self.json["animations"][0]
        sampler = {
            "input": self.accessor(times.astype("<f4"), _FLOAT, "SCALAR"),
            "output": self.accessor(_rounded(values), _FLOAT, f"VEC{values.shape[1]}"),
            "interpolation": method,
        }
        self.json["accessors"][sampler["input"]] |= {"min": [float(times.min())], "max": [float(times.max())]}
        animation["channels"].append({"sampler": len(animation["samplers"]), "target": {"node": node, "path": path}})
        animation["samplers"].append(sampler)

    def roots(self) -> list[int]:
        """The nodes that are nobody's child."""
        children = {child for node in self.json["nodes"] for child in node.get("children", [])}
        return [index for index in range(len(self.json["nodes"])) if index not in children]

    def to_bytes(self) -> bytes:
        """The finished container."""
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json, separators=(",", ":"), sort_keys=True).encode()
        text += b" " * (-len(text) % 4)
        blob = bytes(self.blob) + b"\0" * (-len(self.blob) % 4)
        total = 12 + 8 + len(text) + 8 + len(blob)
        head = struct.pack("<4sII", b"glTF", 2, total)
        return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Float32 on a grid of 2**-20, a micrometre: last bits and signs of zero differ between processors."""
    return (np.round(values * 2.0**20) / 2.0**20 + 0.0).astype("<f4")
