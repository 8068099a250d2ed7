"""Opening an OpenGL 4.3 context without a window, and saying in a sentence why there is none."""

from __future__ import annotations

import sys
from typing import Any

import moderngl

from ..errors import NO_GRAPHICS, UserError

Context = moderngl.Context
REQUIRED = 430  # compute shaders, SSBOs and indirect dispatch


def headless_context() -> moderngl.Context:
    """A context on EGL (Linux) or the platform's own means. Raises UserError(exit code 3) if there is none."""
    if sys.platform == "darwin":
        raise UserError("macOS stops at OpenGL 4.1 and has no compute shaders; use Linux or Windows", NO_GRAPHICS)
    backend: dict[str, Any] = {"backend": "egl"} if sys.platform.startswith("linux") else {}
    try:
        return moderngl.create_context(standalone=True, require=REQUIRED, **backend)
    except Exception as error:  # glcontext raises bare Exception for a missing library, device or version
        advice = "install a driver, or Mesa: apt-get install libegl1 libgl1-mesa-dri"
        raise UserError(f"no OpenGL 4.3 context could be opened ({error}); {advice}", NO_GRAPHICS) from error


def leave_framebuffers(ctx: moderngl.Context) -> None:
    """Bind framebuffer 0, before releasing one that may be bound.

    moderngl binds "the one before" again after it makes a framebuffer; if that is gone, every later one is a GL error.
    """
    ctx.detect_framebuffer(0).use()


def device_name(ctx: moderngl.Context) -> str:
    """What figures are published under, e.g. "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5 Mesa 22.3.6"."""
    return f"{ctx.info['GL_RENDERER']}, OpenGL {ctx.info['GL_VERSION']}"


def is_software(ctx: moderngl.Context) -> bool:
    """True on a CPU rasteriser, whose milliseconds are never GPU figures."""
    return any(name in ctx.info["GL_RENDERER"].lower() for name in ("llvmpipe", "softpipe", "swrast", "swr"))
