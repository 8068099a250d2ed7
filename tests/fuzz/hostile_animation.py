"""Hostile glTF animations: their times, values, channels and chains."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.cpu.gltf_maker import Maker

from .cases import Case, gltf

TURN = [[0, 0, 0, 1], [0, 1, 0, 0]]
SLIDE = [[0, 0, 0], [1, 0, 0]]


def _animate(maker: Maker, nodes: list[int], times: Any, values: Any, path: str, **sampler: Any) -> None:
    keys, moves = maker.accessor(np.asarray(times, "<f4")), maker.accessor(np.asarray(values, "<f4"))
    channels = [{"sampler": 0, "target": {"node": node, "path": path}} for node in nodes]
    maker.add("animations", {"samplers": [{"input": keys, "output": moves, **sampler}], "channels": channels})


def _moving(
    times: Any, values: Any = None, path: str = "translation", node: dict[str, Any] | None = None, **sampler: Any
) -> Case:
    def bend(maker: Maker) -> None:
        moved = maker.triangle()
        maker.json["nodes"][moved].update(node or {})
        given = SLIDE if values is None else values
        _animate(maker, [moved], times, given, path, **sampler)

    return gltf(bend)


def _chain(count: int, values: Any, path: str = "translation") -> Case:
    """Nodes one below another that all move."""

    def bend(maker: Maker) -> None:
        maker.triangle()
        maker.json["nodes"] = [{"children": [i + 1]} for i in range(count)] + maker.json["nodes"]
        _animate(maker, list(range(count)), [0, 1], values, path)

    return gltf(bend)


def _many(count: int) -> Case:
    def bend(maker: Maker) -> None:
        first = maker.triangle()
        mesh = maker.json["nodes"][first]["mesh"]
        nodes = [first, *(maker.node(mesh=mesh) for _ in range(count - 1))]
        _animate(maker, nodes, [0, 1], SLIDE, "translation")

    return gltf(bend)


CASES: dict[str, Case] = {
    "keys out of order": _moving([1, 0]),
    "keys at nan": _moving([0, np.nan]),
    "keys at infinity": _moving([0, np.inf]),
    "keys before time": _moving([-1, 1]),
    "keys at one time": _moving([1, 1]),
    "keys at zero": _moving([0, 0]),
    "keys a denormal apart": _moving([0, 1e-45]),
    "keys an age apart": _moving([0, 3e38]),
    "keys that say nan": _moving([0, 1], [[0, 0, 0], [np.nan, 0, 0]]),
    "keys that go far": _moving([0, 1], [[0, 0, 0], [3e38, 0, 0]]),
    "keys that turn by nothing": _moving([0, 1], [[0, 0, 0, 0]] * 2, "rotation"),
    "keys that turn by huge quaternions": _moving([0, 1], [[3e38] * 4, [-3e38] * 4], "rotation"),
    "keys that turn by tiny quaternions": _moving([0, 1], [[1e-45, 0, 0, 0], [0, 1e-45, 0, 0]], "rotation"),
    "keys that turn half round": _moving([0, 1], TURN, "rotation"),
    "fewer values than keys": _moving([0, 1, 2]),
    "more values than keys": _moving([0]),
    "no keys": _moving(np.zeros(0), np.zeros((0, 3))),
    "one key": _moving([0], [[0, 1, 0]]),
    "keys of scales": _moving([0, 1], path="scale"),
    "keys of weights": _moving([0, 1], path="weights"),
    "keys of nothing": _moving([0, 1], path="\x1b[31m"),
    "spline with a key too few": _moving([0, 1], [[0, 0, 0]] * 5, interpolation="CUBICSPLINE"),
    "an unknown interpolation": _moving([0, 1], interpolation="SPLINE\n"),
    "a moving node given by a matrix": _moving([0, 1], node={"matrix": np.eye(4).ravel().tolist()}),
    "a moving node pressed flat": _moving([0, 1], node={"scale": [1, 1, 0]}),
    "a moving node scaled unevenly": _moving([0, 1], node={"scale": [1, 1e-4, 1]}),
    "a moving node of scale 1e300": _moving([0, 1], node={"scale": [1e300, 1e300, 1e300]}),
    "a chain of a hundred": _chain(100, SLIDE),
    "a chain of sixty-four that goes far": _chain(64, [[0, 0, 0], [3e38, 0, 0]]),
    "a chain of fifty that turns": _chain(50, TURN, "rotation"),
    "three hundred moving": _many(300),
}
