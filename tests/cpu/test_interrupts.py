"""Ctrl-C while the program is still being imported, loads, builds and caches: one line, code 130, nothing half done."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from app.interrupts import held_back
from tests.interrupt import INTERRUPTED, run


@pytest.mark.parametrize(
    "place",
    [
        "import app.cli",
        "import numpy",
        "import scipy",  # by trimesh, which takes whatever happens then for the lack of it
        "call scene/load.py:load_scene",
        "call bvh/build.py:build_bvh",
        "call app/files.py:_settle",  # the cache's file is written, but has not its name yet
    ],
)
def test_anywhere_on_the_way_to_a_scene(place: str, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert run(place, "info", str(tmp_path / "a.obj"), cache=tmp_path / "cache") == INTERRUPTED
    assert [path for path in (tmp_path / "cache").rglob("*") if path.is_file()] == []


def test_what_is_held_back_comes_at_the_end_of_the_block() -> None:
    done = []

    def block() -> None:
        with held_back():
            signal.raise_signal(signal.SIGINT)
            done.append("inside")
        done.append("after")

    with pytest.raises(KeyboardInterrupt):
        block()
    assert done == ["inside"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with held_back():
        pass
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
