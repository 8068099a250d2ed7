"""A log of the window's state as JSON lines, one per change: for scripts that drive it and tests that watch it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..errors import UserError


class StatusLog:
    """Appends a state when it differs from the last one written. Without a path it does nothing."""

    def __init__(self, path: str | Path | None) -> None:
        self._last: dict[str, Any] = {}
        try:
            self._file = open(path, "a", encoding="utf-8", buffering=1) if path else None  # noqa: SIM115  kept open: a line per change
        except OSError as error:
            raise UserError(f"--status {path}: {error.strerror or error}") from None

    def write(self, state: dict[str, Any]) -> None:
        """Note a state."""
        if self._file and state != self._last:
            self._file.write(json.dumps(state) + "\n")
            self._last = state

    def close(self) -> None:
        if self._file:
            self._file.close()
