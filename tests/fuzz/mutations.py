"""Ways to bend a file: its bytes, the numbers in its text, or, knowing its structure, any one value of its JSON."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

Random = np.random.Generator

_WORDS = (
    b"\0\0\0\0",
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\0\0\0\x80",
    b"\0\0\xc0\x7f",
    b"\0\0\x80\x7f",
    b"\x01\0\0\0",
)


def _place(data: bytes, rng: Random) -> int:
    return int(rng.integers(0, len(data) + 1))


def _truncated(data: bytes, rng: Random) -> bytes:
    return data[: _place(data, rng)]


def _flipped(data: bytes, rng: Random) -> bytes:
    """Up to 16 bits turned over."""
    out = bytearray(data)
    for bit in rng.integers(0, 8 * max(len(data), 1), int(rng.integers(1, 17))):
        if bit // 8 < len(out):
            out[bit // 8] ^= 1 << (bit % 8)
    return bytes(out)


def _word(data: bytes, rng: Random) -> bytes:
    """Four bytes replaced by a count, an index or a number that is bad in any role."""
    at = _place(data, rng) & ~3
    return data[:at] + _WORDS[rng.integers(len(_WORDS))] + data[at + 4 :]


def _spliced(data: bytes, rng: Random) -> bytes:
    """A chunk copied over another place."""
    a, b, length = _place(data, rng), _place(data, rng), int(rng.integers(1, 200))
    return data[:a] + data[b : b + length] + data[a + length :]


def _doubled(data: bytes, rng: Random) -> bytes:
    a, length = _place(data, rng), int(rng.integers(1, 200))
    return data[: a + length] + data[a:]


def _removed(data: bytes, rng: Random) -> bytes:
    a, length = _place(data, rng), int(rng.integers(1, 200))
    return data[:a] + data[a + length :]


def _noise(data: bytes, rng: Random) -> bytes:
    a, length = _place(data, rng), int(rng.integers(1, 60))
    return data[:a] + rng.bytes(length) + data[a + length :]


_BYTES: tuple[Callable[[bytes, Random], bytes], ...] = (
    _truncated, _flipped, _word, _spliced, _doubled, _removed, _noise,
)  # fmt: skip


def bent_bytes(data: bytes, rng: Random) -> bytes:
    """One mutation that knows nothing of the format."""
    return _BYTES[rng.integers(len(_BYTES))](data, rng)


_TOKENS = (
    b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e999", b"1e-320", b"-1", b"0", b"1", b"4294967296",
    b"99999999999999999999", b"2000000000", b"", b"x", b"1/", b"//", b"/1", b"-0", b"0x10", b"1_0", b"\xff\xfe",
    b"\0", b"1 " * 500, b"../../etc/passwd", b"/etc/passwd", b"a" * 5000, b"\xe2\x80\xae", b"\x1b[31m", b"\\",
    b"double", b"list",
)  # fmt: skip
_TOKEN = re.compile(rb"[^\s/]+")


def bent_text(data: bytes, rng: Random) -> bytes:
    """One token replaced by a bad one, or one line left out, doubled or moved."""
    lines = data.split(b"\n")
    line = int(rng.integers(len(lines)))
    action = rng.integers(8)
    if action == 0:
        del lines[line]
    elif action == 1:
        lines.insert(line, lines[rng.integers(len(lines))])
    else:
        tokens = list(_TOKEN.finditer(data))
        if tokens:
            token = tokens[rng.integers(len(tokens))]
            return data[: token.start()] + _TOKENS[rng.integers(len(_TOKENS))] + data[token.end() :]
    return b"\n".join(lines)


class Raw(str):
    """JSON text that no Python value writes."""


_GONE = object()  # the key is left out
_AGAIN = object()  # an array's entry is there a thousand times
_VALUES: tuple[Any, ...] = (
    _GONE, None, True, False, 0, -1, 1, 2, 3, 7, 255, 2**31 - 1, 2**32, 2**63, -(2**63), 10**30,
    Raw("9" * 5000), Raw("9" * 400), 0.5, -0.5, -0.0, 1e-320, 1e30, 1e308, -1e308, Raw("1e999"), Raw("-1e999"),
    Raw("NaN"), Raw("Infinity"), 5126, 5125, 5120, "", "x", "SCALAR", "MAT4", "VEC3", "../../etc/passwd",
    "/etc/passwd", "%2e%2e/%2e%2e/etc/passwd", "file:///etc/passwd", "http://example.org/x", "C:\\x",
    "model.bin", "data:,", "data:image/png;base64,AAAA", "a" * 5000, "\ud800", "a\nb\x1b[31m\u202e", "\0", [],
    [[]], [0], [0, 0, 0], [0, 0, 0, 0], [1e308] * 3, [-1e308] * 4, [0] * 16, [1e308] * 16, [1e-300] * 3,
    [None] * 3, ["x"] * 4, [0, 0, 0, 1e-200], [True] * 4, {}, {"index": 0}, {"index": -1}, {"extensions": None},
    Raw("[" * 400 + "]" * 400), _AGAIN,
)  # fmt: skip


def json_pairs(document: Any) -> int:
    """How many ways there are to bend one value of a document."""
    return sum(1 for _ in _spots(document)) * len(_VALUES)


def bent_json(document: Any, number: int) -> str:
    """The document's text with one value bent, by number below `json_pairs`: neighbours bend different values in
    different ways, so that any run of numbers is a fair sample of both.
    """
    copy = json.loads(json.dumps(document))
    spots = list(_spots(copy))
    spot, round_ = number % len(spots), number // len(spots)
    holder, key = spots[spot]
    value = _VALUES[(round_ + 29 * spot) % len(_VALUES)]
    if value is _GONE:
        del holder[key]
    elif value is _AGAIN:
        holder[key] = [holder[key]] * 1000
        if isinstance(holder, list):
            holder[key : key + 1] = holder[key]
    else:
        holder[key] = _marked(value)
    return _unmarked(json.dumps(copy))


def _spots(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every (container, key) of a JSON document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield value, key
        yield from _spots(inner)


def _marked(value: Any) -> Any:
    return f"@raw {value}@" if isinstance(value, Raw) else value


def _unmarked(text: str) -> str:
    return re.sub(r'"@raw ([^"]*)@"', r"\1", text)


def split_glb(data: bytes) -> tuple[Any, bytes]:
    """(document, binary chunk) of a whole GLB."""
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def joined_glb(text: str, blob: bytes) -> bytes:
    """A GLB of JSON text and a binary chunk."""
    data = text.encode("utf-8", "surrogatepass")
    data += b" " * (-len(data) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(data) + len(blob), len(data), b"JSON")
    return head + data + struct.pack("<I4s", len(blob), b"BIN\0") + blob
