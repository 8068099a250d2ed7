"""Image files to 8-bit RGBA arrays, several at once (Pillow releases the interpreter lock while it inflates).

A picture of a few kilobytes may claim to be of any size. All sizes are read before any picture is inflated.
"""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import PIL.Image

from ..errors import UserError, quoted
from .model import Image

MAX_SIDE = 16384  # the texture size every OpenGL 4.3 driver offers
MAX_PIXELS = 1 << 27  # of one image, 16384 x 8192: half a GiB inflated, and 1.2 GiB while it is being converted
MAX_ALL_PIXELS = 1 << 30  # of all images of a scene, 4 GiB: 256 of the largest that are drawn, on the GPU 11 GiB
# What Pillow may read. Its other decoders are seldom used and less tested, and that for PostScript starts a program.
GLTF_FORMATS = ("PNG", "JPEG", "WEBP")
FORMATS = (*GLTF_FORMATS, "BMP", "GIF", "TGA", "TIFF")

Job = tuple[bytes | memoryview, bool, str]


def decode_all(jobs: Sequence[Job], source: str) -> tuple[Image, ...]:
    """Decode (encoded bytes, srgb, name) each; UserError names the image and the file `source` it came with."""
    pictures = [opened(data, name, source, GLTF_FORMATS) for data, _, name in jobs]
    check_total([p.width * p.height for p in pictures], source)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        arrays = pool.map(lambda picture, job: inflated(picture, job[2], source), pictures, jobs)
        return tuple(Image(array, srgb, name) for array, (_, srgb, name) in zip(arrays, jobs))


def opened(data: bytes | memoryview, name: str, source: str, formats: tuple[str, ...] = FORMATS) -> PIL.Image.Image:
    """A picture of which only the header was read. Raises UserError for an unknown format or too large a size."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PIL.Image.DecompressionBombWarning)  # our own limit follows
            picture = PIL.Image.open(io.BytesIO(data), formats=formats)
    except PIL.Image.DecompressionBombError:
        raise _too_large(name, source) from None
    except (OSError, ValueError, SyntaxError, OverflowError, MemoryError) as error:
        raise _damaged(name, source) from error
    check_size(picture, name, source)
    return picture


def check_size(picture: PIL.Image.Image, name: str, source: str) -> None:
    """Raise UserError if the picture is too large."""
    if max(picture.size) > MAX_SIDE or picture.width * picture.height > MAX_PIXELS:
        raise _too_large(name, source)


def check_total(sizes: Sequence[int], source: str) -> None:
    """Raise UserError if the images of one scene, of so many pixels each, are too large together."""
    total = sum(sizes)
    if total > MAX_ALL_PIXELS:
        raise UserError(
            f"{source}: its {len(sizes)} images have {total >> 20} million pixels together, over the limit of "
            f"{MAX_ALL_PIXELS >> 20} million: scale them down."
        )


def inflated(picture: PIL.Image.Image, name: str, source: str) -> np.ndarray:
    """(h, w, 4) uint8, top row first. Raises UserError when it is damaged."""
    try:
        return pixels(picture)
    except (OSError, ValueError, SyntaxError, OverflowError, PIL.Image.DecompressionBombError) as error:
        raise _damaged(name, source) from error


def readable(path: Path) -> bool:
    """Whether a file begins like a picture that `opened` would take."""
    try:
        opened(path.read_bytes(), path.name, str(path)).close()
    except (OSError, UserError):
        return False
    return True


def pixels(picture: PIL.Image.Image) -> np.ndarray:
    """(h, w, 4) uint8, top row first."""
    if picture.mode.startswith("I;16"):  # Pillow would clip 16-bit grey at 255 instead of scaling it
        grey = (np.asarray(picture) >> 8).astype(np.uint8)
        return np.dstack([grey, grey, grey, np.full_like(grey, 255)])
    return np.asarray(picture.convert("RGBA"))


def _damaged(name: str, source: str) -> UserError:
    return UserError(f"{source}: image '{quoted(name)}' cannot be decoded: save it again as PNG or JPEG.")


def _too_large(name: str, source: str) -> UserError:
    return UserError(
        f"{source}: image '{quoted(name)}' is larger than {MAX_SIDE} pixels a side or {MAX_PIXELS >> 20} million "
        "pixels: scale it down."
    )
