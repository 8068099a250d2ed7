"""Files of the user: paths as they were typed, and writing so that a file is there whole or not at all.

Nothing else writes a file: whatever fails on the way (a full disk, a read-only folder, an interruption), what was there
before stays as it was, and nothing half done is left behind.
"""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import UserError

UNFINISHED = ".unfinished"  # how the name of a file ends while it is being written


def user_path(text: str | Path) -> Path:
    """A path as a person types it, `~` meaning home. Raises UserError where there is no such home."""
    try:
        return Path(text).expanduser()
    except RuntimeError:
        raise UserError(f"{text}: there is no such home folder; write the path in full") from None


def is_file(path: Path) -> bool:
    """Whether a file can be found there; False for names that no file can have (too long, with a NUL)."""
    with suppress(OSError, ValueError):
        return path.is_file()
    return False


def is_folder(path: Path) -> bool:
    """Whether a folder can be found there, likewise."""
    with suppress(OSError, ValueError):
        return path.is_dir()
    return False


def check_folder(path: str | Path, option: str) -> None:
    """Raise UserError if the folder that `option`'s file would lie in does not exist."""
    if not is_folder(Path(path).absolute().parent):
        raise UserError(f"{option} {path}: there is no folder {Path(path).parent}")


def make_folder(path: Path) -> None:
    """Make a folder and those above it, unless they exist. Raises UserError naming it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot make the folder {path}: {error.strerror or error}") from None


def write_atomically(path: str | Path, write: Callable[[str], object]) -> None:
    """Let `write` fill a temporary file in the same folder, then rename it. Raises UserError naming the file; leaves
    nothing behind.
    """
    try:
        with replacing(Path(path)) as temporary:
            write(str(temporary))
    except OSError as error:
        raise UserError(f"cannot write {path}: {error.strerror or error}") from None


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, line ends as they are. Raises UserError naming it."""
    write_atomically(path, lambda temporary: Path(temporary).write_text(text, encoding="utf-8", newline=""))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A file beside `path` to fill; it takes the place of `path` if the block ends well, and is gone otherwise.

    A link is followed: the file that it names is replaced. Raises OSError, also for what is there and is no file.
    """
    path = Path(os.path.realpath(path))
    _refuse_devices(path)
    # The name's length does not grow with that of `path`, which may be as long as the file system allows.
    handle, name = tempfile.mkstemp(suffix=path.suffix[:8] + UNFINISHED, prefix=".", dir=path.parent)
    os.close(handle)
    try:
        yield Path(name)
        _settle(name)
        os.replace(name, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise


def _refuse_devices(path: Path) -> None:
    """A device or a pipe must not be replaced by a file: as root, that would work."""
    with suppress(FileNotFoundError):
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise IsADirectoryError("it is a folder" if stat.S_ISDIR(mode) else "it is no ordinary file")


def _settle(name: str) -> None:
    """Give a temporary file a new file's permissions and have it on the disk: some file systems find out only then that
    there is no room, and after a crash the renamed file would be empty.
    """
    with suppress(PermissionError):  # file systems without permissions refuse
        os.chmod(name, 0o666 & ~_umask())
    with open(name, "rb+") as file:
        os.fsync(file.fileno())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
