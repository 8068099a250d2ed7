"""The cache gives back what was built, and fails without harm."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from app.bvh import build, cache
from app.bvh.build import Bvh

POSITIONS = np.random.default_rng(0).random((300, 3), np.float32)
INDICES = np.arange(300, dtype=np.uint32).reshape(-1, 3)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path / "cache"))
    return cache.cache_dir()


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Grows by one with each tree that is really built."""
    calls: list[int] = []

    def counted(*args: object) -> Bvh:
        calls.append(1)
        return build.build_bvh(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(cache, "build_bvh", counted)
    return calls


def same(a: Bvh, b: Bvh) -> bool:
    return (
        a.nodes.dtype == b.nodes.dtype
        and a.nodes.tobytes() == b.nodes.tobytes()
        and a.order.tobytes() == b.order.tobytes()
        and (a.depth, a.stats) == (b.depth, b.stats)
    )


def test_second_time_reads_the_file(builds: list[int], folder: Path) -> None:
    first, notes = cache.load_or_build(POSITIONS, INDICES)
    second, more = cache.load_or_build(POSITIONS, INDICES)
    assert same(first, second)
    assert (len(builds), notes, more) == (1, (), ())
    assert [f.name for f in folder.iterdir()] == [cache.content_key(POSITIONS, INDICES) + ".bvh.npz"]


def test_empty_scene(builds: list[int]) -> None:
    nothing = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)
    assert same(cache.load_or_build(*nothing)[0], cache.load_or_build(*nothing)[0])
    assert len(builds) == 1


def test_key_sees_everything_the_tree_depends_on(monkeypatch: pytest.MonkeyPatch) -> None:
    moved, turned = POSITIONS.copy(), INDICES.copy()
    moved[17, 2] += 1e-6
    turned[3] = turned[3, ::-1]
    keys = {
        cache.content_key(POSITIONS, INDICES),
        cache.content_key(moved, INDICES),
        cache.content_key(POSITIONS, turned),
    }
    for name in ("BUILDER_VERSION", "LEAF_SIZE", "NODE_COST", "MAX_DEPTH"):
        with monkeypatch.context() as patch:
            patch.setattr(build, name, getattr(build, name) + 1)
            keys.add(cache.content_key(POSITIONS, INDICES))
    assert len(keys) == 7


@pytest.mark.parametrize("damage", ["truncated", "garbage", "empty", "flipped", "folder"])
def test_damaged_file_is_built_again_and_replaced(damage: str, builds: list[int], folder: Path) -> None:
    good, _ = cache.load_or_build(POSITIONS, INDICES)
    (file,) = folder.iterdir()
    data = bytearray(file.read_bytes())
    if damage == "folder":
        file.unlink()
        file.mkdir()
    elif damage == "flipped":
        data[len(data) // 2] ^= 1
        file.write_bytes(data)
    else:
        file.write_bytes({"truncated": data[: len(data) // 2], "garbage": b"not a zip file" * 99, "empty": b""}[damage])
    again, notes = cache.load_or_build(POSITIONS, INDICES)
    assert same(good, Bvh(again.nodes, again.order, again.depth, good.stats))
    assert len(builds) == 2
    assert len(notes) == 1
    if damage != "folder":
        assert cache.load_or_build(POSITIONS, INDICES)[1] == ()
        assert len(builds) == 2


def test_another_scenes_file_under_this_key_is_refused(builds: list[int], folder: Path) -> None:
    cache.load_or_build(POSITIONS, INDICES[:50])
    (file,) = folder.iterdir()
    file.rename(folder / (cache.content_key(POSITIONS, INDICES) + ".bvh.npz"))
    bvh, notes = cache.load_or_build(POSITIONS, INDICES)
    assert len(bvh.order) == len(INDICES)
    assert len(notes) == 1


def test_unwritable_folder_only_earns_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("a file where a folder should be")
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path / "file"))
    bvh, notes = cache.load_or_build(POSITIONS, INDICES)
    assert len(bvh.order) == len(INDICES)
    assert "could not be cached" in notes[0]


def test_failed_write_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    def full(*args: object, **kwargs: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez", full)
    _, notes = cache.load_or_build(POSITIONS, INDICES)
    assert "no space left" in notes[0]
    assert list(folder.iterdir()) == []


def test_least_recently_used_trees_go_first(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    counts = (40, 60, 80)
    for age, count in enumerate(counts):
        cache.load_or_build(POSITIONS, INDICES[:count])
        file = folder / (cache.content_key(POSITIONS, INDICES[:count]) + ".bvh.npz")
        os.utime(file, (1000 + age, 1000 + age))
    cache.load_or_build(POSITIONS, INDICES[:40])  # a use makes the oldest the newest
    size = sum(f.stat().st_size for f in folder.iterdir())
    monkeypatch.setattr(cache, "SIZE_LIMIT", size + 500)  # room for three of the four
    cache.load_or_build(POSITIONS, INDICES[:61])
    left = {f.name.removesuffix(".bvh.npz") for f in folder.iterdir()}
    assert left == {cache.content_key(POSITIONS, INDICES[:n]) for n in (40, 80, 61)}


def test_bad_geometry_is_not_the_caches_to_forgive() -> None:
    with pytest.raises(ValueError, match="coordinate"):
        cache.load_or_build(POSITIONS * np.nan, INDICES)
