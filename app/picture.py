"""Pictures on disk: tone-mapped PNG with its settings, linear EXR, and reports beside them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, PngImagePlugin

from .errors import UserError
from .files import check_folder, is_folder, write_atomically, write_text

SUFFIXES = (".png", ".exr")


def check_path(path: str | Path) -> Path:
    """The path if a picture can be written there. Raises UserError before any time is spent rendering."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"-o {path}: name a file ending in .png or .exr")
    check_folder(path, "-o")
    if is_folder(path):
        raise UserError(f"-o {path} is a folder; name a file")
    if path.suffix.lower() == ".exr":
        _openexr()
    return path


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

    def write(temporary: str) -> None:
        try:
            exr.File(header, channels).write(temporary)
        except RuntimeError as error:  # what OpenEXR makes of a full disk
            raise OSError(str(error).replace(f' "{temporary}"', "").removesuffix(".")) from error

    write_atomically(path, write)


def read_exr(path: str | Path) -> np.ndarray:
    """(h, w, 3) float32 of a file that `write_exr` wrote."""
    with _openexr().File(str(path)) as file:
        return np.array(file.channels()["RGB"].pixels)


def write_json(path: str | Path, values: Mapping[str, Any]) -> None:
    """Write a report."""
    write_text(path, json.dumps(values, indent=1) + "\n")


def _openexr() -> Any:
    try:
        import OpenEXR
    except ImportError:
        raise UserError("writing .exr needs OpenEXR: pip install 'hybrid-dof[exr]', or name a .png") from None
    return OpenEXR
