"""Where the window keeps what it remembers from one run to the next."""

from __future__ import annotations

from pathlib import Path

from platformdirs import user_config_dir


def ini_file() -> str:
    """Where ImGui remembers the panel's width; empty (nothing is remembered) if the folder cannot be made."""
    folder = Path(user_config_dir("hybrid-dof", appauthor=False))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return ""
    return str(folder / "panel.ini")
