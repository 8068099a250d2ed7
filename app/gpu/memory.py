"""Whether the storage of a frame fits, asked before it is made; and what the driver says once it is.

OpenGL does not tell how much memory is left. A software rasteriser draws from the system's, which is known; any other
device is asked by trying, after each texture, since a failure raises nothing and leaves a picture black.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..errors import UserError
from ..frame.records import Buffer, Target
from .context import Context, is_software

MEMORY_FILE = Path("/proc/meminfo")  # Linux; elsewhere nothing is refused before it is tried
KEPT_SHARE = 0.1  # of the free memory: for reading pictures back, and for others

_BYTES = {"f1": 1, "f2": 2, "f4": 4}
Size = tuple[int, int]


def scaled(size: Size, scale: int) -> Size:
    """Size at 1/scale, rounded up so that every full-resolution pixel is covered."""
    return -(-size[0] // scale), -(-size[1] // scale)


def texels(target: Target, size: Size) -> Size:
    """Width and height of a target at a full resolution."""
    return target.fixed or scaled(size, target.scale)


def texture_bytes(target: Target, size: Size) -> int:
    """Bytes of one texture of a target at a full resolution, without its history."""
    width, height = texels(target, size)
    return width * height * target.components * _BYTES[target.dtype]


def buffer_bytes(buffer: Buffer, size: Size) -> int:
    """Bytes of a storage block at a full resolution."""
    width, height = scaled(size, buffer.scale)
    return buffer.header + buffer.bytes_per_pixel * width * height


def frame_bytes(targets: Iterable[Target], size: Size) -> int:
    """Bytes of all textures of some targets, histories and depth test included."""
    return sum(texture_bytes(t, size) * (1 + t.history) for t in targets) + 4 * size[0] * size[1]


def free_bytes(ctx: Context) -> int | None:
    """Bytes that textures may still take, or None where only trying tells."""
    if not is_software(ctx):
        return None
    try:
        lines = dict(line.split(":", 1) for line in MEMORY_FILE.read_text().splitlines() if ":" in line)
        return int(lines["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError, ValueError, IndexError):
        return None


def check_frame(ctx: Context, targets: Iterable[Target], size: Size, held: int) -> None:
    """Raise UserError if the targets of a frame cannot all be made beside the `held` bytes that exist of them."""
    needed, free = frame_bytes(targets, size) - held, free_bytes(ctx)
    if free is not None and needed > (1.0 - KEPT_SHARE) * free:
        raise too_large(size, f"needs {needed / 2**30:.1f} GiB more, and {free / 2**30:.1f} GiB of memory are free")


def check_made(ctx: Context, size: Size, what: str) -> None:
    """Raise UserError if the driver had no memory for `what` it has just been asked for."""
    if ctx.error == "GL_OUT_OF_MEMORY":
        raise too_large(size, f"leaves no memory on this device for {what}")


def too_large(size: Size, why: str) -> UserError:
    """A picture that is too large, in a sentence."""
    return UserError(f"--size {size[0]}x{size[1]} {why}: choose a smaller size")
