"""Ctrl-C in the commands that draw: one line, code 130, and the file that was there before is there still."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interrupt import INTERRUPTED, run

SMALL = ("toy-train", "--size", "48x27")
COMMANDS = {  # by the place where they are interrupted
    "call gpu/programs.py:_link": ("shot", *SMALL, "-o", "{file}.png"),
    "call app/files.py:_settle": ("shot", *SMALL, "--view", "sharp", "--frames", "1", "-o", "{file}.png"),
    "call measure/savings.py:measuring": ("plan", *SMALL, "--measure"),
    "call measure/reference.py:_begin": ("tune", *SMALL, "--error", "0.01", "--spp", "8", "-o", "{file}.json"),
    "call measure/tune.py:_measured": ("tune", *SMALL, "--ms", "50", "--spp", "8", "-o", "{file}.json"),
    "call gpu/timing.py:self_test": ("doctor",),
}


@pytest.mark.parametrize("place", COMMANDS)
def test_a_command_that_draws(place: str, tmp_path: Path) -> None:
    arguments = [text.format(file=tmp_path / "old") for text in COMMANDS[place]]
    kept = [Path(text) for text in arguments if text.startswith(str(tmp_path))]
    for path in kept:
        path.write_bytes(b"old")
    code, _, said = run(place, *arguments, cache=tmp_path / "cache")
    assert (code, said) == (INTERRUPTED[0], INTERRUPTED[2])
    assert [path.read_bytes() for path in kept] == [b"old"] * len(kept)
    assert {path for path in tmp_path.iterdir() if path.is_file()} == set(kept)
