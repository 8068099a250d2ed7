"""Where the files that ship beside the code live, in a checkout and in an installed wheel alike."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_dir(kind: str) -> Path:
    """The folder of shipped files of one kind ("assets", "glsl"): inside the wheel, else beside the package.

    Raises FileNotFoundError when neither exists, which means a broken installation.
    """
    candidates = (_PACKAGE / "_data" / kind, _PACKAGE.parent / kind)
    for folder in candidates:
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"no {kind} folder at {' or '.join(map(str, candidates))}: reinstall hybrid-dof")
