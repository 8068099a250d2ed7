"""The cache gives back what was built, and fails without harm."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from app.bvh import build, cache
from app.bvh.build import Bvh
from app.bvh.pack import BVH_NODE, is_inner, is_leaf, leaf_reference
from app.cache import ABANDONED_S, write_arrays
from app.files import UNFINISHED

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


def test_a_bit_turned_over_anywhere_gives_the_same_tree_or_a_note(folder: Path, soak: bool) -> None:
    """A checksum guards the arrays, but not the headers around them: those may then say anything."""
    few = INDICES[:6]
    good, _ = cache.load_or_build(POSITIONS, few)
    (file,) = folder.iterdir()
    data = file.read_bytes()
    noted, places = 0, range(0, len(data), 1 if soak else 5)
    for place in places:
        damaged = bytearray(data)
        damaged[place] ^= 1 << (place % 8)
        file.write_bytes(damaged)
        bvh, notes = cache.load_or_build(POSITIONS, few)
        assert same(bvh, Bvh(good.nodes, good.order, good.depth, bvh.stats)), place
        noted += bool(notes)
    assert noted > len(places) // 4


@pytest.mark.parametrize("damage", ["order", "leaf", "node", "depth", "step"])
def test_a_whole_file_with_wrong_references_is_built_again(damage: str, folder: Path) -> None:
    """Rays follow what a tree refers to without asking: it must not leave the arrays, nor go in circles."""
    good, _ = cache.load_or_build(POSITIONS, INDICES)
    (file,) = folder.iterdir()
    with np.load(file) as data:
        arrays = {name: data[name].copy() for name in data}
    nodes = arrays["nodes"].view(BVH_NODE)[:, 0]
    child = nodes["child"]
    if damage == "order":
        arrays["order"][3] = arrays["order"][4]
    elif damage == "leaf":
        child[is_leaf(child)] = leaf_reference(np.array([len(INDICES)]), np.array([4]))[0]
    elif damage == "node":
        child[is_inner(child)] = 0  # the root again
    elif damage == "depth":
        arrays["depth"] = np.array(0)
    else:
        nodes["step_x"][0] = np.nan
    write_arrays(file, **arrays)
    bvh, notes = cache.load_or_build(POSITIONS, INDICES)
    assert same(bvh, Bvh(good.nodes, good.order, good.depth, bvh.stats))
    assert "was built again" in notes[0]


@pytest.mark.parametrize("where", ["below a file", "read-only", "no such device"])
def test_the_command_goes_on_without_a_cache(
    where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from app.cli import main

    folder = {
        "below a file": tmp_path / "file" / "x",
        "read-only": Path("/proc/none"),
        "no such device": Path("/dev/null/x"),
    }
    if where == "read-only" and not Path("/proc").is_dir():
        pytest.skip("there is no /proc here")
    (tmp_path / "file").write_text("")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(folder[where]))
    assert main(["info", str(tmp_path / "a.obj")]) == 0
    told = capsys.readouterr()
    assert told.out.count("could not be cached") == 1
    assert told.err == ""


def test_what_a_killed_program_left_is_cleared_away_but_not_what_is_being_written(folder: Path) -> None:
    folder.mkdir(parents=True)
    for name, age in (("old", 2 * ABANDONED_S), ("new", 0.0)):
        file = folder / f".{name}{UNFINISHED}"
        file.write_bytes(b"half")
        os.utime(file, (time.time() - age,) * 2)
    cache.load_or_build(POSITIONS, INDICES)
    assert [f.name for f in folder.glob(".*")] == [f".new{UNFINISHED}"]
