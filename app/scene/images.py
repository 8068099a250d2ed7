"""Image files to 8-bit RGBA arrays, several at once (Pillow releases the interpreter lock while it inflates)."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import PIL.Image

from ..errors import UserError
from .model import Image

MAX_SIDE = 16384  # the texture size every OpenGL 4.3 driver offers; more would also be a way to exhaust memory


def decode_all(jobs: Sequence[tuple[bytes | memoryview, bool, str]], source: str) -> tuple[Image, ...]:
    """Decode (encoded bytes, srgb, name) each; UserError names the image and the file `source` it came with."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return tuple(pool.map(lambda job: decode(job[0], job[1], job[2], source), jobs))


def decode(data: bytes | memoryview, srgb: bool, name: str, source: str) -> Image:
    """One encoded image. Raises UserError when it is damaged, too large or of an unknown format."""
    try:
        with PIL.Image.open(io.BytesIO(data)) as picture:
            if max(picture.size) > MAX_SIDE:
                raise UserError(f"{source}: image {name!r} is larger than {MAX_SIDE} pixels: scale it down.")
            return Image(pixels(picture), srgb, name)
    except (OSError, ValueError, SyntaxError, PIL.Image.DecompressionBombError) as error:
        raise UserError(f"{source}: image {name!r} cannot be decoded: save it again as PNG or JPEG.") from error


def pixels(picture: PIL.Image.Image) -> np.ndarray:
    """(h, w, 4) uint8, top row first."""
    if picture.mode.startswith("I;16"):  # Pillow would clip 16-bit grey at 255 instead of scaling it
        grey = (np.asarray(picture) >> 8).astype(np.uint8)
        return np.dstack([grey, grey, grey, np.full_like(grey, 255)])
    return np.array(picture.convert("RGBA"))
