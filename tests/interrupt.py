"""Runs the program and presses Ctrl-C at a chosen place: `python -m tests.interrupt PLACE ARGUMENTS...`.

PLACE is `import NAME`, before that module is read, or `call PATH:FUNCTION`, as that function of a file that ends in
PATH is entered. A place that is never reached is told by exit code 70, unless the program failed before.
"""

from __future__ import annotations

import importlib.abc
import os
import runpy
import signal
import subprocess
import sys
from pathlib import Path
from types import FrameType
from typing import Any

NEVER_THERE = 70
INTERRUPTED = (130, "", "hybrid-dof: interrupted\n")  # exit code, stdout, stderr
pressed: list[str] = []


def run(place: str, *arguments: str, cache: Path) -> tuple[int, str, str]:
    """Run a command with Ctrl-C pressed there; exit code, stdout, stderr."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.interrupt", place, *arguments],
        cwd=Path(__file__).parents[1],
        env={**os.environ, "HYBRID_DOF_CACHE": str(cache)},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    return done.returncode, done.stdout, done.stderr


def press(place: str) -> None:
    """As a terminal does it, once."""
    if not pressed:
        pressed.append(place)
        signal.raise_signal(signal.SIGINT)


class AtImport(importlib.abc.MetaPathFinder):
    def __init__(self, name: str) -> None:
        self._name = name

    def find_spec(self, name: str, *_: Any) -> None:
        if name == self._name:
            press(name)


def at_call(path: str, function: str) -> Any:
    def look(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_name == function and code.co_filename.endswith(path):
            press(function)

    return look


def main() -> None:
    kind, _, where = sys.argv[1].partition(" ")
    sys.argv[1:] = sys.argv[2:]
    if kind == "import":
        sys.meta_path.insert(0, AtImport(where))
    else:
        sys.setprofile(at_call(*where.split(":")))
    try:
        runpy.run_module("app", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        sys.exit(end.code if pressed or end.code else NEVER_THERE)


if __name__ == "__main__":
    main()
