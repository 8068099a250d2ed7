"""Arrays of records that shaders read by index (glsl/shared/records.glsl), and the device limit on each.

They are storage blocks, as GPUs like them. A software rasteriser reads a storage block one lane at a time: on llvmpipe
51 ns for a 64-byte record in every lane, against 5 ns for the same bytes in a texture, which made rays three to four
times slower than they had to be. There the records go into textures, unfiltered, their bytes unchanged.
"""

from __future__ import annotations

import moderngl

from ..errors import UserError
from .context import is_software
from .layout import TEXEL_BYTES, TEXELS_PER_ROW

IN_TEXTURES = "RECORDS_IN_TEXTURES"  # the define that makes shaders look for them there
ROW_BYTES = TEXEL_BYTES * TEXELS_PER_ROW


class RecordTexture:
    """Records as texels of four words; has what is used of a `moderngl.Buffer`."""

    def __init__(self, ctx: moderngl.Context, data: bytes) -> None:
        rows = -(-len(data) // ROW_BYTES)
        padded = data.ljust(rows * ROW_BYTES, b"\0")
        self.texture = ctx.texture((TEXELS_PER_ROW, rows), 4, padded, dtype="u4")
        self.texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self.size = len(padded)

    def write(self, data: bytes) -> None:
        """Replace the first records."""
        whole = len(data) // ROW_BYTES * ROW_BYTES
        if whole:
            self.texture.write(data[:whole], viewport=(0, 0, TEXELS_PER_ROW, whole // ROW_BYTES))
        if rest := data[whole:]:
            self.texture.write(rest, viewport=(0, whole // ROW_BYTES, len(rest) // TEXEL_BYTES, 1))

    def read(self) -> bytes:
        """All records, and the zeros after them."""
        return bytes(self.texture.read())

    def release(self) -> None:
        self.texture.release()


Records = moderngl.Buffer | RecordTexture


def in_textures(ctx: moderngl.Context) -> bool:
    """Whether this device reads records faster from textures."""
    return is_software(ctx)


def make_records(ctx: moderngl.Context, data: bytes, textures: bool) -> Records:
    """An array of records, as a texture or as a storage block."""
    return RecordTexture(ctx, data) if textures else ctx.buffer(data)


def check_fits(ctx: moderngl.Context, what: str, count: int, textures: bool) -> None:
    """Raise UserError if `count` bytes of a scene's records, named in words, are more than this device takes."""
    limit = ctx.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"]
    if textures:
        limit = ctx.info["GL_MAX_TEXTURE_SIZE"] * ROW_BYTES
    if count > limit:
        raise UserError(
            f"the scene's {what} need {_mib(count)} in one block, but this device allows {_mib(limit)}: choose a "
            "smaller scene"
        )


def _mib(count: int) -> str:
    return f"{count / 2**20:.0f} MiB"
