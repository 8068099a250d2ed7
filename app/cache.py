"""Files that spare computing something again, in the user's cache folder: whole or absent, and bounded in size.

A cache may fail in any way (unreadable, corrupt, read-only, full, removed while in use). Whoever uses it catches
FAILURES, computes the thing and may say why it took longer; a cache never stops the program.
"""

from __future__ import annotations

import os
import struct
import time
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_dir

from .files import UNFINISHED, replacing

CACHE_VARIABLE = "HYBRID_DOF_CACHE"  # environment: another folder than the user's cache
ABANDONED_S = 3600.0  # no file takes longer to write
# What reading or writing a damaged or forbidden file raises: zipfile checks a checksum of every array, but the headers
# may ask for encryption (RuntimeError), an unknown method (its subclass NotImplementedError) or any shape.
FAILURES = (
    OSError, ValueError, KeyError, TypeError, EOFError, RuntimeError, MemoryError, OverflowError, SyntaxError,
    struct.error, zlib.error, zipfile.BadZipFile,
)  # fmt: skip


def cache_folder(kind: str) -> Path:
    """The folder that one kind of thing is kept in; it need not exist."""
    return Path(os.environ.get(CACHE_VARIABLE) or user_cache_dir("hybrid-dof", appauthor=False)) / kind


def used(path: Path) -> None:
    """Count reading a file as a use: the least recently used go first."""
    with suppress(OSError):
        os.utime(path)


def write_arrays(path: Path, **arrays: NDArray[Any] | float) -> None:
    """An .npz file: a reader sees the whole of it or none. Raises FAILURES."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def drop_oldest(folder: Path, suffix: str, limit: int) -> None:
    """Remove the least recently used files of a kind until the rest fits into `limit` bytes, and what was left
    unfinished by a program that was killed.
    """
    files = sorted(((f.stat().st_mtime_ns, f.stat().st_size, f) for f in folder.glob("*" + suffix)), reverse=True)
    kept = 0
    for _, size, file in files:
        kept += size
        if kept > limit:
            with suppress(OSError):
                file.unlink()
    for file in folder.glob(f".*{UNFINISHED}"):
        with suppress(OSError):
            if file.stat().st_mtime < time.time() - ABANDONED_S:
                file.unlink()
