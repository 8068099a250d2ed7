"""Whether the storage of a frame fits, asked before it is made; and what the driver says once it is.

OpenGL does not tell how much memory is left. A software rasteriser draws from the system's, which is known; any other
device is asked by trying, after each texture, since a failure raises nothing and leaves a picture black.
"""

from __future__ import annotations

from pathlib import Path

from ..errors import UserError
from .context import Context, is_software

MEMORY_FILE = Path("/proc/meminfo")  # Linux; elsewhere nothing is refused before it is tried
KEPT_SHARE = 0.1  # of the free memory: for reading pictures back, and for others

Size = tuple[int, int]


def free_bytes(ctx: Context) -> int | None:
    """Bytes that textures may still take, or None where only trying tells."""
    if not is_software(ctx):
        return None
    try:
        lines = dict(line.split(":", 1) for line in MEMORY_FILE.read_text().splitlines() if ":" in line)
        return int(lines["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError, ValueError, IndexError):
        return None


def check_frame(ctx: Context, needed: int, size: Size) -> None:
    """Raise UserError if so many bytes more than there are cannot be had for a frame."""
    free = free_bytes(ctx)
    if free is not None and needed > (1.0 - KEPT_SHARE) * free:
        raise too_large(size, f"needs {needed / 2**30:.1f} GiB more, and {free / 2**30:.1f} GiB of memory are free")


def check_made(ctx: Context, size: Size, what: str) -> None:
    """Raise UserError if the driver had no memory for `what` it has just been asked for."""
    if ctx.error == "GL_OUT_OF_MEMORY":
        raise too_large(size, f"leaves no memory on this device for {what}")


def too_large(size: Size, why: str) -> UserError:
    """A picture that is too large, in a sentence."""
    return UserError(f"--size {size[0]}x{size[1]} {why}: choose a smaller size")
