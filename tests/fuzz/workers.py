"""Processes that look at one case after another, within limits of memory and time: what kills one is a result as well.

`python -m tests.fuzz.workers` reads names of cases and writes an outcome, as a line of JSON, for each.
"""

from __future__ import annotations

import json
import os
import resource
import selectors
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
MEMORY = 2 << 30  # bytes that a case may have mapped beyond what the imports need
TIME_S = 30.0  # for one case, in which the slowest takes 3 s on an idle core; none is near it but by a hang


class Result(NamedTuple):
    """What became of a case."""

    name: str
    kind: str  # as examine.Outcome, or "lost": the process died or hung
    text: str
    seconds: float


class _Worker:
    def __init__(self) -> None:
        command = [sys.executable, "-m", "tests.fuzz.workers"]
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.case, self.since = "", 0.0

    def give(self, case: str) -> None:
        assert self.process.stdin
        self.case, self.since = case, time.monotonic()
        self.process.stdin.write(case + "\n")
        self.process.stdin.flush()

    def take(self) -> Result:
        """The outcome that is ready; without one the process has died."""
        assert self.process.stdout
        line = self.process.stdout.readline()
        seconds = time.monotonic() - self.since
        if line:
            return Result(self.case, *json.loads(line), seconds)
        return Result(self.case, "lost", f"the process ended with {self.process.wait()}", seconds)

    def stop(self) -> None:
        self.process.kill()
        self.process.communicate()


def run(cases: Iterable[str], workers: int) -> Iterator[Result]:
    """Look at all cases; results come as they are ready."""
    waiting = deque(cases)
    with selectors.DefaultSelector() as ready:
        for _ in range(min(workers, len(waiting))):
            _begin(ready, waiting)
        try:
            while ready.get_map():
                for key, _ in ready.select(timeout=1.0):
                    result = key.data.take()
                    yield result
                    _go_on(ready, key, waiting, result.kind == "lost")
                for key in list(ready.get_map().values()):
                    if (seconds := time.monotonic() - key.data.since) > TIME_S:
                        yield Result(key.data.case, "lost", "hung", seconds)
                        _go_on(ready, key, waiting, True)
        finally:
            for key in list(ready.get_map().values()):
                key.data.stop()


def _begin(ready: selectors.BaseSelector, waiting: deque[str]) -> None:
    worker = _Worker()
    worker.give(waiting.popleft())
    assert worker.process.stdout
    ready.register(worker.process.stdout, selectors.EVENT_READ, worker)


def _go_on(ready: selectors.BaseSelector, key: selectors.SelectorKey, waiting: deque[str], lost: bool) -> None:
    """The next case to the same worker, or to a new one in its place."""
    if waiting and not lost:
        key.data.give(waiting.popleft())
        return
    ready.unregister(key.fileobj)
    key.data.stop()
    if waiting:
        _begin(ready, waiting)


def _serve() -> None:
    import trimesh  # noqa: F401  so that no case pays for it

    from . import corpus
    from .examine import examine

    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # nobody else's words among the results
    mapped = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + MEMORY, mapped + MEMORY))
    with TemporaryDirectory() as root:
        for number, line in enumerate(sys.stdin):
            folder = Path(root) / str(number)
            folder.mkdir()
            contents = corpus.files(line.rstrip("\n"))
            for name, data in contents.items():
                (folder / name).write_bytes(data)
            print(json.dumps(examine(folder / next(iter(contents)))), file=out, flush=True)
            for name in contents:
                (folder / name).unlink()


if __name__ == "__main__":
    _serve()
