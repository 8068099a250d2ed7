"""Pictures on disk: tone-mapped PNG with its settings, linear EXR. Written beside their final name and renamed, so that
none is half there.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, PngImagePlugin

from .errors import UserError

SUFFIXES = (".png", ".exr")


def check_path(path: str | Path) -> Path:
    """The path if a picture can be written there. Raises UserError before any time is spent rendering."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"-o {path}: name a file ending in .png or .exr")
    check_folder(path, "-o")
    if path.is_dir():
        raise UserError(f"-o {path} is a folder; name a file")
    if path.suffix.lower() == ".exr":
        _openexr()
    return path


def check_folder(path: str | Path, option: str) -> None:
    """Raise UserError if the folder that `option`'s file would lie in does not exist."""
    if not Path(path).parent.is_dir():
        raise UserError(f"{option} {path}: there is no folder {Path(path).parent}")


def write_png(path: str | Path, rgb: np.ndarray, metadata: Mapping[str, Any]) -> None:
    """Write (h, w, 3) uint8 sRGB, top row first, with `metadata` as JSON in the text field "hybrid-dof"."""
    info = PngImagePlugin.PngInfo()
    info.add_text("hybrid-dof", json.dumps(metadata, sort_keys=True))
    write_atomically(path, lambda temporary: Image.fromarray(rgb).save(temporary, format="PNG", pnginfo=info))


def write_exr(path: str | Path, linear: np.ndarray, metadata: Mapping[str, Any]) -> None:
    """Write (h, w, 3) float32 linear radiance, top row first. Raises UserError without the `exr` extra."""
    exr = _openexr()
    header = {
        "compression": exr.ZIP_COMPRESSION,
        "type": exr.scanlineimage,
        "comments": json.dumps(metadata, sort_keys=True),
    }
    channels = {"RGB": np.ascontiguousarray(linear, np.float32)}
    write_atomically(path, lambda temporary: exr.File(header, channels).write(temporary))


def read_exr(path: str | Path) -> np.ndarray:
    """(h, w, 3) float32 of a file that `write_exr` wrote."""
    with _openexr().File(str(path)) as file:
        return np.array(file.channels()["RGB"].pixels)


def write_json(path: str | Path, values: Mapping[str, Any]) -> None:
    """Write a report."""
    text = json.dumps(values, indent=1) + "\n"
    write_atomically(path, lambda temporary: Path(temporary).write_text(text))


def write_atomically(path: str | Path, write: Callable[[str], object]) -> None:
    """Let `write` fill a temporary file in the same folder, then rename it. Raises UserError naming the file; leaves
    nothing behind.
    """
    path = Path(path)
    try:
        handle, temporary = tempfile.mkstemp(suffix=path.suffix, prefix=f".{path.stem}-", dir=path.parent or Path())
        os.close(handle)
    except OSError as error:
        raise UserError(f"cannot write {path}: {error.strerror or error}") from None
    try:
        write(temporary)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        raise UserError(f"cannot write {path}: {error.strerror or error}") from None
    finally:
        Path(temporary).unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _openexr() -> Any:
    try:
        import OpenEXR
    except ImportError:
        raise UserError("writing .exr needs OpenEXR: pip install 'hybrid-dof[exr]', or name a .png") from None
    return OpenEXR
