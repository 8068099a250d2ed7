"""A log of the window's state as JSON lines, one per change: for scripts that drive it and tests that watch it."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import UserError


class StatusLog:
    """Appends a state when it differs from the last one written. Without a path it does nothing."""

    def __init__(self, path: str | Path | None) -> None:
        self._last: dict[str, Any] = {}
        self._path = path
        try:
            self._file = open(path, "a", encoding="utf-8", buffering=1) if path else None  # noqa: SIM115  kept open: a line per change
        except OSError as error:
            raise UserError(f"--status {path}: {error.strerror or error}") from None

    def write(self, state: dict[str, Any], say: Callable[[str], None]) -> None:
        """Note a state. Where the disk takes no more the log ends, and `say` is told so, once."""
        if self._file and state != self._last:
            try:
                self._file.write(json.dumps(state) + "\n")
            except OSError as error:
                self.close()
                say(f"--status {self._path}: {error.strerror or error}; the log ends here")
            self._last = state

    def close(self) -> None:
        """End the log; what is not on the disk by then is lost."""
        if self._file:
            with suppress(OSError):
                self._file.close()
            self._file = None
