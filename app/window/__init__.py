"""The interactive window. `open_window` is all that the command line needs."""

from __future__ import annotations

from .loop import open_window

__all__ = ["open_window"]
