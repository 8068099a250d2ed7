"""What a benchmark has finished, in its folder: each run is written at once, so that an interrupted one goes on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import UserError
from ..files import make_folder
from ..picture import write_json

FORMAT = "hybrid-dof bench 1"  # of bench.json; its number changes with the meaning of what it holds
CONFIGURATION = "configuration.json"
RUNS = "runs"  # the folder in the benchmark's own that holds a folder of files for each scene
OURS = ("bench.json", "bench.csv", "bench.md")


class Store:
    """Values by scene and label, kept as a file each."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @property
    def folder(self) -> Path:
        return self._folder

    def begin(self, configuration: Mapping[str, Any], *, fresh: bool = False) -> None:
        """Make the folder, or go on in it. Raises UserError if it holds a benchmark of another configuration."""
        runs = self._folder / RUNS
        if fresh:
            self._clear()
        kept = self._read(runs / CONFIGURATION)
        if kept is None and any(runs.glob("*/*.json")):
            kept = {}  # without its configuration nothing of what is there can be trusted
        wanted = json.loads(json.dumps(configuration))
        if kept is not None and kept != wanted:
            differing = sorted(k for k in kept.keys() | wanted.keys() if kept.get(k) != wanted.get(k))
            raise UserError(
                f"-o {self._folder} holds a benchmark with another {', '.join(differing)}: "
                "name another folder, or start over there with --fresh"
            )
        make_folder(runs)
        if kept is None:
            write_json(runs / CONFIGURATION, wanted)

    def get(self, scene: str, label: str) -> Any:
        """What was put there; None if nothing (whole) was."""
        return self._read(self._path(scene, label))

    def put(self, scene: str, label: str, values: Mapping[str, Any]) -> None:
        """Keep values: the file is there whole or not at all."""
        path = self._path(scene, label)
        make_folder(path.parent)
        write_json(path, values)

    def _path(self, scene: str, label: str) -> Path:
        return self._folder / RUNS / scene / f"{label}.json"

    def _clear(self) -> None:
        """Remove what a benchmark wrote, and nothing else."""
        runs = self._folder / RUNS
        for path in (*runs.glob("*/*.json"), runs / CONFIGURATION, *(self._folder / name for name in OURS)):
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                raise UserError(f"cannot remove {path}: {error.strerror or error}") from None

    @staticmethod
    def _read(path: Path) -> Any:
        try:
            return json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None


def read_results(path: Path) -> dict[str, Any]:
    """A benchmark's results from its bench.json or its folder. Raises UserError."""
    file = path / "bench.json" if path.is_dir() else path
    try:
        values = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"--compare {file}: {error.strerror or error}") from None
    except ValueError as error:
        raise UserError(f"--compare {file} is not JSON: {error}") from None
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise UserError(f"--compare {file} is no bench.json of this version; run the benchmark again")
    return values
