"""Under which key a reference is kept: a hash of all that decides the picture, the program's own text included."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..camera import Moment, camera_values
from ..frame.raster import RASTER
from ..frame.traced import REFERENCE, TRACED
from ..gpu.shaders import assemble, load_glsl
from ..settings import Settings, plain, walk

SUFFIX = ".reference.npz"
SIZE_LIMIT = 1 << 30  # bytes: some 20 references of 1920x1080 pixels, 150 of 640x360

PACKAGE = Path(__file__).parents[1]
# Passes and modules that make the picture of each view that can be a reference.
PASSES = {"reference": (*RASTER, *REFERENCE), "traced": (*RASTER, *REFERENCE, *TRACED)}
_GPU = ("arrays", "frame_block", "layout", "objects", "octahedral", "scene", "shadow", "textures")
_RASTER = (
    "camera.py",
    "optics.py",
    "sampling.py",
    "frame/raster.py",
    "scene/*.py",
    "measure/reference.py",
    "measure/shares.py",
    *(f"gpu/{name}.py" for name in _GPU),
)
SOURCES = {"reference": _RASTER, "traced": (*_RASTER, "frame/traced.py", "bvh/*.py", "gpu/records.py")}


def reference_key(
    device: str, scene: str, view: str, size: tuple[int, int], spp: int, moment: Moment, settings: Settings
) -> str:
    """Differs whenever the reference would. Of the settings only the lens' and the shading's reach linear light."""
    parts = {
        "sources": sources_digest(view),
        "device": device,
        "scene": scene,
        "view": view,
        "size": size,
        "spp": spp,
        "camera": camera_values(moment.camera),
        "time_s": moment.time_s,
        "settings": {
            path: plain(value)
            for path, leaf, value in walk(settings)
            if path.startswith(("lens.", "shading.")) and leaf.metadata["resets"]
        },
    }
    return digest([json.dumps(parts, sort_keys=True)])[:32]


@cache
def sources_digest(view: str) -> str:
    """Of all shaders and modules that a reference by this view is made by."""
    files = load_glsl()
    stems = {step.shader: step.kind for step in PASSES[view]} | {"raster/shadow": "raster"}
    names = [f"{s}{end}" for s, kind in stems.items() for end in ((".vert", ".frag") if kind == "raster" else ("",))]
    texts = [assemble(name, files).text for name in sorted(names)]
    modules = [path for pattern in SOURCES[view] for path in sorted(PACKAGE.glob(pattern))]
    return digest([*texts, *(path.read_text(encoding="utf-8") for path in modules)])


def scene_digest(scene: Any) -> str:
    """What tells a loaded scene (app/scene/model.py) from every other: a hash of all its values but the load report,
    which holds seconds.
    """
    state = hashlib.blake2b(digest_size=16)
    for part in _parts(scene):
        state.update(part)
    return state.hexdigest()


def _parts(value: Any) -> Iterator[bytes | memoryview]:
    """The bytes of a value made of dataclasses, tuples, arrays and scalars, with what marks where each begins."""
    if is_dataclass(value):
        yield f"\0{type(value).__name__}".encode()
        for field in fields(value):
            if field.name != "report":
                yield from _parts(getattr(value, field.name))
    elif isinstance(value, np.ndarray):
        yield f"\0{value.dtype}{value.shape}".encode()
        yield np.ascontiguousarray(value).reshape(-1).view(np.uint8).data
    elif isinstance(value, tuple):
        yield f"\0({len(value)}".encode()
        for item in value:
            yield from _parts(item)
    else:
        yield f"\0{value.value if isinstance(value, Enum) else value!r}".encode()


def digest(texts: Iterable[str]) -> str:
    """A hash of some texts in order."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()
