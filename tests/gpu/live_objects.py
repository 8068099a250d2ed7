"""What exists on the GPU, by the driver's own word: whatever no Python object knows of any more is counted, too."""

from __future__ import annotations

import ctypes
from collections import Counter
from collections.abc import Callable

import moderngl

KINDS = ("Texture", "Buffer", "Framebuffer", "VertexArray", "Program", "Shader", "Sampler", "Query")
DELETE_STATUS = 0x8B80
HIGHEST_NAME = 1024  # of drivers that hand out the lowest names that are free; of others, the newest is the highest
COMPUTE_SHADER = 0x91B9


def live_objects(ctx: moderngl.Context) -> Counter[str]:
    """Number of GL objects of each kind, without those that were deleted while the driver still refers to them."""
    load = ctx.mglo._context.load  # type: ignore[attr-defined]
    found: Counter[str] = Counter()
    for kind in KINDS:
        exists = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(load(f"glIs{kind}"))
        names = [name for name in range(1, max(HIGHEST_NAME, _newest(load, kind))) if exists(name)]
        if kind in ("Program", "Shader"):
            ask = ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p)(load(f"glGet{kind}iv"))
            names = [name for name in names if not _asked(ask, name)]
        found[kind] = len(names)
    return found


def _newest(load: Callable[[str], int], kind: str) -> int:
    """A name that the driver gives just now, and takes back."""
    names = (ctypes.c_uint * 1)()
    if kind in ("Program", "Shader"):
        make = ctypes.CFUNCTYPE(ctypes.c_uint, *[ctypes.c_uint] * (kind == "Shader"))(load(f"glCreate{kind}"))
        names[0] = make(COMPUTE_SHADER) if kind == "Shader" else make()
        ctypes.CFUNCTYPE(None, ctypes.c_uint)(load(f"glDelete{kind}"))(names[0])
        return names[0]
    kinds = "Queries" if kind == "Query" else f"{kind}s"
    for deed in ("Gen", "Delete"):
        ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p)(load(f"gl{deed}{kinds}"))(1, names)
    return names[0]


def _asked(ask: ctypes._CFunctionType, name: int) -> bool:  # type: ignore[name-defined]
    deleted = ctypes.c_int(0)
    ask(name, DELETE_STATUS, ctypes.byref(deleted))
    return bool(deleted.value)
