"""Whatever fails while a file is written: the old one stays, nothing is left over, and one sentence names it."""

from __future__ import annotations

import errno
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from app.camera import Camera, Viewpoint, write_viewpoint
from app.errors import UserError
from app.files import UNFINISHED, check_folder, is_file, replacing, user_path, write_atomically, write_text
from app.measure.bench_store import CONFIGURATION, RUNS, Store
from app.picture import write_exr, write_json, write_png
from app.presets import Preset, write_preset
from app.window.status import StatusLog

NOISE = np.random.default_rng(3)
BIG = NOISE.integers(0, 256, (300, 300, 3), dtype=np.uint8)  # noise does not deflate: 270 kB
TEXTS = {"text": "x" * 300_000}

# Everything the program saves for a user, made too large for a small disk.
WRITERS: dict[str, Callable[[Path], object]] = {
    "a.png": lambda path: write_png(path, BIG, {}),
    "a.exr": lambda path: write_exr(path, NOISE.random((300, 300, 3), np.float32), {}),
    "report.json": lambda path: write_json(path, TEXTS),
    "preset.json": lambda path: write_preset(path, Preset(), TEXTS),
    "camera.json": lambda path: write_viewpoint(path, Viewpoint(Camera(), name="x")),
    "bench.csv": lambda path: write_text(path, "x" * 300_000),
}


def listing(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """A folder on a disk of its own with no room left."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = shutil.which("mount")
    command = [mount or "mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    if not mount or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("mounting a small disk takes root")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def fill(folder: Path) -> None:
    """Leave no room but for the names of new files."""
    with suppress(OSError), (folder / "ballast").open("wb", buffering=0) as ballast:
        while True:
            ballast.write(bytes(4096))


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_keeps_the_old_file_and_says_so(full_disk: Path, name: str) -> None:
    if name.endswith("exr"):
        pytest.importorskip("OpenEXR")
    path = full_disk / name
    path.write_bytes(b"old")
    fill(full_disk)
    with pytest.raises(UserError, match="No space left") as error:
        WRITERS[name](path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    assert path.read_bytes() == b"old"
    assert listing(full_disk) == sorted(["ballast", name])


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("fault", [errno.ENOSPC, errno.EACCES, errno.EROFS, errno.EIO])
def test_any_fault_keeps_the_old_file_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, fault: int
) -> None:
    if name.endswith("exr"):
        pytest.importorskip("OpenEXR")
    path = tmp_path / name
    path.write_bytes(b"old")

    def fails(*args: object) -> None:
        raise OSError(fault, os.strerror(fault))

    monkeypatch.setattr(os, "replace", fails)
    with pytest.raises(UserError, match=os.strerror(fault)) as error:
        WRITERS[name](path)
    assert str(path) in str(error.value)
    assert path.read_bytes() == b"old"
    assert listing(tmp_path) == [name]


@pytest.mark.parametrize("name", WRITERS)
def test_a_folder_that_is_none_is_one_sentence(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("")  # nothing can be written below a file, not even by root
    with pytest.raises(UserError, match="cannot write"):
        WRITERS[name](tmp_path / "file" / name)


def test_data_is_on_the_disk_before_the_old_file_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that finds out late that it is full, as those over a network do."""
    path = tmp_path / "a.json"
    path.write_text("old")

    def full(handle: int) -> None:
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(UserError, match=os.strerror(errno.EDQUOT)):
        write_json(path, {})
    assert path.read_text() == "old"
    assert listing(tmp_path) == ["a.json"]


def test_a_link_keeps_pointing_where_it_did(tmp_path: Path) -> None:
    (tmp_path / "real.json").write_text("old")
    (tmp_path / "link.json").symlink_to("real.json")
    write_json(tmp_path / "link.json", {"a": 1})
    assert (tmp_path / "link.json").is_symlink()
    assert "1" in (tmp_path / "real.json").read_text()


def test_a_pipe_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    with pytest.raises(UserError, match="no ordinary file"):
        write_json(pipe, {})
    assert pipe.is_fifo()
    assert listing(tmp_path) == ["pipe.json"]


def test_the_longest_name_that_a_disk_allows_can_be_written(tmp_path: Path) -> None:
    path = tmp_path / ("n" * 250 + ".json")
    write_json(path, {})
    assert path.is_file()


def test_names_that_no_file_can_have_are_not_there(tmp_path: Path) -> None:
    for name in ("n" * 5000, "n\0", "a/" * 3000):
        assert not is_file(tmp_path / name)
        with pytest.raises(UserError, match="there is no folder"):
            check_folder(tmp_path / name / "a.png", "-o")


def test_no_such_home_is_one_sentence() -> None:
    with pytest.raises(UserError, match="no such home"):
        user_path("~nobody-of-this-name/a.png")


@pytest.mark.parametrize("arguments", [["info", "~nobody-of-this-name/a.glb"], ["info", "n" * 5000 + ".glb"]])
def test_odd_paths_on_the_command_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    from app.cli import main

    assert main(arguments) == 2
    assert capsys.readouterr().err.startswith("hybrid-dof: ")


def test_a_failed_write_leaves_no_open_temporary(tmp_path: Path) -> None:
    before = os.listdir("/proc/self/fd") if sys.platform == "linux" else []
    for _ in range(20):
        with pytest.raises(UserError):
            write_atomically(tmp_path / "a.png", lambda temporary: Path("/nowhere/x").read_text())
    assert sys.platform != "linux" or len(os.listdir("/proc/self/fd")) <= len(before)
    assert listing(tmp_path) == []


def test_what_is_being_written_can_be_told_from_what_is_there(tmp_path: Path) -> None:
    with replacing(tmp_path / "a.png") as temporary:
        assert temporary.name.endswith(UNFINISHED)
        assert temporary.parent == tmp_path
        temporary.write_text("new")
        assert not (tmp_path / "a.png").exists()
    assert listing(tmp_path) == ["a.png"]


def test_a_benchmark_on_a_full_or_forbidden_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store(tmp_path / "bench")
    store.begin({"a": 1})
    store.put("room", "first", {"x": 1})
    (tmp_path / "bench" / RUNS / "hall").write_text("a file where a scene's folder should be")
    with pytest.raises(UserError, match="hall"):
        store.put("hall", "first", {"x": 1})
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="file"):
        Store(tmp_path / "file").begin({})
    (tmp_path / "bench" / RUNS / CONFIGURATION).unlink()
    (tmp_path / "bench" / RUNS / CONFIGURATION).mkdir()
    with pytest.raises(UserError, match=CONFIGURATION):
        store.begin({}, fresh=True)


def test_a_status_log_on_a_full_disk_ends_the_log_not_the_window(tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full here")
    log = StatusLog("/dev/full")
    said: list[str] = []
    for value in range(3):
        log.write({"a": value}, said.append)
    assert said == ["--status /dev/full: No space left on device; the log ends here"]
    log.close()


def test_only_one_module_writes_files() -> None:
    """Every writer goes through app/files.py; the exceptions are a log, and a developer's tool."""
    app = Path(__file__).parents[2] / "app"
    writing = re.compile(r"\.(write_text|write_bytes|save|savez?)\(|mkstemp|os\.replace|open\([^)]*\"[wax]")
    found = {
        str(path.relative_to(app))
        for path in app.rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if writing.search(line) and "temporary" not in line
    }
    assert found == {"files.py", "cache.py", "window/status.py", "gpu/layout.py"}
