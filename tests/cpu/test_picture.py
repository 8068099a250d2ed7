"""Pictures on disk: complete or absent, exact, with the settings that made them."""

from __future__ import annotations

import json
import os
import stat
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.errors import UserError
from app.picture import check_path, read_exr, write_atomically, write_exr, write_json, write_png
from app.settings import Settings, from_dict, put, to_dict

rng = np.random.default_rng(4)


def listing(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_png_holds_its_pixels_and_its_settings(tmp_path: Path) -> None:
    pixels = rng.integers(0, 256, (5, 7, 3), dtype=np.uint8)
    settings = put(put(Settings(), "lens.aperture", 0.123), "shading.background", (0.1, 0.2, 0.3))
    write_png(tmp_path / "a.png", pixels, {"settings": to_dict(settings), "scene": "Küche"})
    with Image.open(tmp_path / "a.png") as image:
        assert (np.asarray(image) == pixels).all()
        metadata = json.loads(image.text["hybrid-dof"])
    assert from_dict(metadata["settings"]) == settings
    assert metadata["scene"] == "Küche"
    assert listing(tmp_path) == ["a.png"]


def test_equal_pictures_are_equal_files(tmp_path: Path) -> None:
    pixels, metadata = rng.integers(0, 256, (4, 4, 3), dtype=np.uint8), {"b": 1, "a": [1.5, 2]}
    write_png(tmp_path / "a.png", pixels, metadata)
    write_png(tmp_path / "b.png", pixels, dict(reversed(metadata.items())))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_an_exr_is_exact(tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR")
    values = np.exp(rng.uniform(-80, 80, (9, 6, 3))).astype(np.float32)
    values[0, 0] = 0.0, np.finfo(np.float32).max, np.finfo(np.float32).tiny
    values[0, 1] = -1.0, np.inf, 1e-45
    write_exr(tmp_path / "a.exr", values, {"scene": "x"})
    back = read_exr(tmp_path / "a.exr")
    assert back.dtype == np.float32
    assert (back.view(np.uint32) == values.view(np.uint32)).all()
    assert listing(tmp_path) == ["a.exr"]
    flipped = values[::-1]  # not contiguous, as a picture turned upside down is
    write_exr(tmp_path / "a.exr", flipped, {})
    assert (read_exr(tmp_path / "a.exr") == flipped).all()


def test_a_failure_leaves_the_old_picture_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "kept.png"
    path.write_bytes(b"old")

    def fail(temporary: str) -> None:
        Path(temporary).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    with pytest.raises(UserError, match=r"cannot write .*kept\.png: No space left on device"):
        write_atomically(path, fail)
    assert path.read_bytes() == b"old"
    assert listing(tmp_path) == ["kept.png"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_any_interruption_leaves_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    def fail(temporary: str) -> None:
        raise error

    with pytest.raises(error):
        write_atomically(tmp_path / "a.png", fail)
    assert listing(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no umask")
def test_a_picture_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("")
    write_json(tmp_path / "report.json", {"a": 1})
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("plain", "report.json")]
    assert modes[0] == modes[1]


def test_a_relative_path_means_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_json(check_path("x.png").with_suffix(".json"), {"ms": [1.5]})
    assert json.loads(Path("x.json").read_text()) == {"ms": [1.5]}


@pytest.mark.parametrize(
    "name", ["picture", "picture.jpg", "picture.png.txt", ".png", "nowhere/picture.png", "folder.png"]
)
def test_unusable_paths_are_one_sentence_before_rendering(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(UserError, match="-o ") as caught:
        check_path(tmp_path / name)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["a.png", "A.PNG", "b.exr"])
def test_good_paths_pass(tmp_path: Path, name: str) -> None:
    if name.endswith("exr"):
        pytest.importorskip("OpenEXR")
    assert check_path(tmp_path / name) == tmp_path / name


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    folder = tmp_path / "file" / "inside"  # below a file: unwritable for every user, root included
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot write"):
        write_json(folder / "report.json", {})
    assert listing(tmp_path) == ["file"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_one_sentence(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(UserError, match="cannot write"):
        write_json(tmp_path / "report.json", {})
    tmp_path.chmod(0o700)


def test_without_openexr_the_sentence_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(UserError, match=r"hybrid-dof\[exr\]"):
        check_path(tmp_path / "a.exr")
