"""What exists on the GPU, by the driver's own word: whatever no Python object knows of any more is counted, too."""

from __future__ import annotations

import ctypes
from collections import Counter

import moderngl

KINDS = ("Texture", "Buffer", "Framebuffer", "VertexArray", "Program", "Shader", "Sampler", "Query")
DELETE_STATUS = 0x8B80
HIGHEST_NAME = 4096  # drivers hand out the lowest names that are free


def live_objects(ctx: moderngl.Context) -> Counter[str]:
    """Number of GL objects of each kind, without those that were deleted while the driver still refers to them."""
    load = ctx.mglo._context.load  # type: ignore[attr-defined]
    found: Counter[str] = Counter()
    for kind in KINDS:
        exists = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(load(f"glIs{kind}"))
        names = [name for name in range(1, HIGHEST_NAME) if exists(name)]
        if kind in ("Program", "Shader"):
            ask = ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p)(load(f"glGet{kind}iv"))
            names = [name for name in names if not _asked(ask, name)]
        found[kind] = len(names)
    return found


def _asked(ask: ctypes._CFunctionType, name: int) -> bool:  # type: ignore[name-defined]
    deleted = ctypes.c_int(0)
    ask(name, DELETE_STATUS, ctypes.byref(deleted))
    return bool(deleted.value)
