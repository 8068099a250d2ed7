"""The corpus: cases by name, the same files on every machine. "glb json 17" is the 17th way to bend the GLB's JSON."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .hostile import HOSTILE
from .mutations import bent_bytes, bent_json, bent_text, joined_glb, json_pairs, split_glb
from .seeds import SEEDS, Files, seed

KINDS = ("json", "bytes", "text", "beside")


class Part(NamedTuple):
    """Cases of one kind: how many in `make test`, and how many there are at most."""

    seed: str
    kind: str
    short: int
    most: int


def _pairs(name: str) -> int:
    return json_pairs(_document(name))


def _document(name: str) -> object:
    main = next(iter(seed(name).values()))
    return split_glb(main)[0] if name == "glb" else json.loads(main)


def parts() -> list[Part]:
    """All of the corpus but the hostile cases made by hand."""
    endless = 4000
    text = ("obj", "ply ascii", "stl ascii")
    return [
        Part("glb", "json", 300, _pairs("glb")),
        Part("gltf", "json", 260, _pairs("gltf")),
        *(Part(name, "bytes", 30, endless) for name in SEEDS),
        *(Part(name, "text", 40, endless) for name in text),
        *(Part(name, "beside", 30, endless) for name in ("gltf", "obj")),
    ]


def names(soak: bool) -> list[str]:
    """The names of all cases."""
    made = [f"{p.seed}/{p.kind}/{n}" for p in parts() for n in range(p.most if soak else p.short)]
    return [*(f"hostile/{name}" for name in HOSTILE), *made]


def files(name: str) -> Files:
    """The files of a case."""
    origin, kind, *number = name.split("/")
    if origin == "hostile":
        return HOSTILE[kind]()
    return _BENDERS[kind](origin, int(number[0]), np.random.default_rng([zlib.crc32(name.encode()), 5]))


def _json(origin: str, number: int, rng: np.random.Generator) -> Files:
    whole = dict(seed(origin))
    main = next(iter(whole))
    text = bent_json(_document(origin), number)
    whole[main] = (
        joined_glb(text, split_glb(whole[main])[1]) if origin == "glb" else text.encode("utf-8", "surrogatepass")
    )
    return whole


def _bytes(origin: str, number: int, rng: np.random.Generator) -> Files:
    whole = dict(seed(origin))
    main = next(iter(whole))
    whole[main] = bent_bytes(whole[main], rng)
    return whole


def _text(origin: str, number: int, rng: np.random.Generator) -> Files:
    whole = dict(seed(origin))
    main = next(iter(whole))
    whole[main] = bent_text(whole[main], rng)
    return whole


def _beside(origin: str, number: int, rng: np.random.Generator) -> Files:
    """A file that the model refers to is bent or gone."""
    whole = dict(seed(origin))
    beside = [*whole][1:]
    victim = beside[rng.integers(len(beside))]
    if rng.random() < 0.1:
        del whole[victim]
    else:
        whole[victim] = (bent_text if victim.endswith(".mtl") else bent_bytes)(whole[victim], rng)
    return whole


_BENDERS: dict[str, Callable[[str, int, np.random.Generator], Files]] = {
    "json": _json,
    "bytes": _bytes,
    "text": _text,
    "beside": _beside,
}
