"""The outside of a glTF 2.0 asset: GLB chunks, JSON, buffers and URIs. glTF 2.0 specification, sections 3.6 and 4."""

from __future__ import annotations

import base64
import binascii
import json
import math
import posixpath
import struct
import urllib.parse
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..errors import UserError, quoted
from ..files import is_file

Json = dict[str, Any]

_MAGIC, _JSON_CHUNK, _BIN_CHUNK = b"glTF", b"JSON", b"BIN\0"


class GltfFile:
    """A parsed document with the bytes it refers to. Every reader asks here, so every reference is checked once."""

    def __init__(self, path: Path) -> None:
        """Read and parse; raises UserError when the file is no complete glTF 2.0."""
        self.path = path
        data = _read(path)
        text, self._bin = _split_glb(data, path) if data[:4] == _MAGIC else (data, None)
        self.json = _parse(text, path)
        version = str(self.json.get("asset", {}).get("version", "?"))
        if not version.startswith("2."):
            raise UserError(f"{path} is glTF version {quoted(version)}: convert it to glTF 2.0.")
        self.buffer = lru_cache(maxsize=None)(self._buffer)

    def item(self, kind: str, index: object) -> Json:
        """Entry `index` of the top-level array `kind`; UserError when the reference leads nowhere."""
        items = self.json.get(kind, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
            raise self.broken(f"refers to {kind}[{quoted(index)}], which does not exist")
        entry: Json = items[index]
        return entry

    def broken(self, what: str) -> UserError:
        """The error for damage in this file; `what` continues the sentence 'FILE ...'."""
        return UserError(f"{self.path} {what}: re-export the file.")

    def view(self, index: object) -> tuple[memoryview, int]:
        """(bytes, stride) of a bufferView; stride 0 means tightly packed."""
        view = self.item("bufferViews", index)
        if "EXT_meshopt_compression" in view.get("extensions", {}):
            raise UserError(f"{self.path} uses meshopt compression, which is not supported: export it uncompressed.")
        data = self.buffer(view["buffer"])
        start, length = int(view.get("byteOffset", 0)), int(view["byteLength"])
        if start < 0 or length < 0 or start + length > len(data):
            raise self.broken(f"has bufferViews[{index}] reaching past the end of its buffer")
        return data[start : start + length], int(view.get("byteStride", 0))

    def _buffer(self, index: object) -> memoryview:
        buffer = self.item("buffers", index)
        if "uri" in buffer:
            data = self.resource(buffer["uri"])
        elif index == 0 and self._bin is not None:
            data = self._bin
        else:
            raise self.broken(f"has no data for buffers[{index}]")
        if len(data) < int(buffer["byteLength"]):
            raise self.broken(f"has only {len(data)} of the {quoted(buffer['byteLength'])} bytes of buffers[{index}]")
        return memoryview(data)

    def resource(self, uri: str) -> bytes:
        """The bytes behind a data URI or a relative, possibly percent-encoded file name below the asset's folder."""
        if uri.startswith("data:"):
            return self._data_uri(uri)
        # A few exporters write names unencoded, where '%' or '#' may stand for itself: try the name as it is, second.
        names = (urllib.parse.unquote(uri), uri)
        for name in names:
            if _escapes(name):
                raise UserError(
                    f"{self.path} refers to '{quoted(name)}', outside its own folder: put the file beside it."
                )
        found = [self.path.parent / name for name in names if is_file(self.path.parent / name)]
        if not found:
            raise UserError(f"{self.path} refers to '{quoted(names[0])}', which is missing: put the file beside it.")
        return _read(found[0])

    def _data_uri(self, uri: str) -> bytes:
        head, comma, payload = uri.partition(",")
        if not comma or not head.endswith(";base64"):
            raise self.broken("holds a data URI that is not base64")
        try:
            return base64.b64decode(urllib.parse.unquote(payload), validate=True)
        except (binascii.Error, ValueError) as error:
            raise self.broken("holds a damaged data URI") from error


def _escapes(name: str) -> bool:
    """Whether a relative reference leaves its folder: absolute, a drive, another scheme, or too many '..'."""
    name = name.replace("\\", "/")
    return "\0" in name or ":" in name or name.startswith("/") or posixpath.normpath(name).split("/")[0] == ".."


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"{path} cannot be read ({error.strerror}): check the path.") from error


def _split_glb(data: bytes, path: Path) -> tuple[bytes, bytes | None]:
    """(JSON, binary chunk or None) of a GLB container."""
    chunks: dict[bytes, bytes] = {}
    try:
        version, length = struct.unpack_from("<II", data, 4)
        if version != 2:
            raise UserError(f"{path} is binary glTF version {version}: convert it to glTF 2.0.")
        if length > len(data):
            raise UserError(f"{path} is truncated: it has {len(data)} of {length} bytes; copy or download it again.")
        at = 12
        while at + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, at)
            if at + 8 + size > length:
                raise UserError(f"{path} is damaged: a chunk reaches past the end; copy or download it again.")
            chunks.setdefault(kind, data[at + 8 : at + 8 + size])
            at += 8 + size + -size % 4
    except struct.error as error:
        raise UserError(f"{path} is truncated: it ends inside its header; copy or download it again.") from error
    if _JSON_CHUNK not in chunks:
        raise UserError(f"{path} has no JSON chunk: it is not a GLB file.")
    return chunks[_JSON_CHUNK], chunks.get(_BIN_CHUNK)


def _parse(text: bytes, path: Path) -> Json:
    try:
        document = json.loads(text.decode("utf-8-sig"), parse_constant=_refuse, parse_float=_finite)
    except (ValueError, RecursionError) as error:
        if not text.strip():
            raise UserError(f"{path} is empty: copy or download it again.") from error
        what = "neither GLB nor glTF JSON" if path.suffix.lower() == ".glb" else "not valid glTF JSON"
        raise UserError(f"{path} is {what} ({quoted(error)}): re-export the file.") from error
    if not isinstance(document, dict):
        raise UserError(f"{path} is not valid glTF JSON (no object at the top): re-export the file.")
    return document


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON number")


def _finite(text: str) -> float:
    """The number, which JSON may write larger than any float: an infinite one never enters."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text:.20} is no finite number")
    return value
