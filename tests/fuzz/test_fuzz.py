"""Whatever a model file holds: it loads with a report and is sound in all its parts, or one sentence says why not."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from . import corpus
from .examine import examine
from .seeds import SEEDS, seed
from .workers import ROOT, run

if sys.platform != "linux":
    pytest.skip("the limit of memory is read from /proc", allow_module_level=True)

FEWEST = 500  # distinct files in the short form


def put(folder: Path, files: dict[str, bytes]) -> Path:
    """Write a model and what lies beside it; the model's path."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return folder / next(iter(files))


@pytest.mark.parametrize("name", SEEDS)
def test_the_files_to_bend_are_good(tmp_path: Path, name: str) -> None:
    assert examine(put(tmp_path, seed(name))).kind == "loaded"


def test_the_corpus_is_the_same_everywhere_and_has_no_file_twice() -> None:
    names = corpus.names(soak=False)
    made = {name: tuple(sorted(corpus.files(name).items())) for name in names if not name.startswith("hostile")}
    assert len(set(made.values())) >= FEWEST
    some = list(made)[::37]
    assert all(tuple(sorted(corpus.files(name).items())) == made[name] for name in some)


def test_every_file_loads_or_ends_in_one_sentence(soak: bool) -> None:
    names = corpus.names(soak)
    kinds: Counter[str] = Counter()
    wrong, slowest = [], (0.0, "")
    for result in run(names, workers=os.cpu_count() or 1):
        kinds[result.kind] += 1
        slowest = max(slowest, (result.seconds, result.name))
        if result.kind not in ("loaded", "refused"):
            wrong.append(f"{result.name}: {result.kind}: {result.text}")
    print(f"{sum(kinds.values())} files: {dict(kinds)}; the slowest took {slowest[0]:.1f} s: {slowest[1]}")
    assert not wrong, f"{len(wrong)} of {len(names)}:\n" + "\n\n".join(sorted(wrong)[:40])
    assert kinds["loaded"] > 0.1 * len(names), "mutations are mild enough to get past the front door"
    assert kinds["refused"] > 0.1 * len(names)


@pytest.mark.parametrize(
    ("case", "code"),
    [
        ("hostile/a picture of 60000x60000", 2),
        ("hostile/brackets a hundred thousand deep", 2),
        ("hostile/ply: vertices 10^12 binary", 2),
        ("hostile/obj: library with nul", 0),
    ],
)
def test_the_command_says_one_sentence_and_exits_with_2(tmp_path: Path, case: str, code: int) -> None:
    model = put(tmp_path, corpus.files(case))
    command = [sys.executable, "-m", "app", "info", str(model)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == code, done.stderr
    if code:
        assert done.stderr.startswith("hybrid-dof: ")
        assert str(model) in done.stderr
    assert done.stderr.count("\n") == (code != 0)
    assert bool(done.stdout) == (code == 0)
