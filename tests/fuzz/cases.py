"""How a case made by hand is put down: a maker to bend, or text, under a name."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.cpu.gltf_maker import Maker

from .seeds import Files

Case = Callable[[], Files]


def gltf(bend: Callable[[Maker], Any], **beside: bytes) -> Case:
    """A .gltf of what is left of a maker after `bend`; `beside` are files next to it, their dots written as `_`."""

    def files() -> Files:
        maker = Maker()
        bend(maker)
        with TemporaryDirectory() as folder:
            model = maker.write(Path(folder) / "model.gltf").read_bytes()
        return {"model.gltf": model, **{name.replace("_", "."): data for name, data in beside.items()}}

    return files


def document(**content: Any) -> Case:
    """A .gltf of JSON alone."""
    return lambda: {"model.gltf": json.dumps({"asset": {"version": "2.0"}, **content}).encode()}


def alone(name: str, data: bytes | Callable[[], bytes]) -> Case:
    """One file of given bytes."""
    return lambda: {name: data if isinstance(data, bytes) else data()}
