"""The wheel carries everything: installed far from the checkout, it renders its own scene with its own shaders."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]


def run(*command: str, cwd: Path, **environment: str) -> str:
    """Run with this Python; returns stdout, fails with everything the command said."""
    done = subprocess.run(
        [sys.executable, *command], cwd=cwd, env=os.environ | environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("wheel")
    run("-m", "hatchling", "build", "--target", "wheel", "--directory", str(out), cwd=ROOT)
    return next(out.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    site = tmp_path_factory.mktemp("site")
    run("-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", str(site), str(wheel), cwd=site)
    return site


def test_the_wheel_holds_shaders_scenes_and_no_tests(wheel: Path) -> None:
    inside = set(zipfile.ZipFile(wheel).namelist())
    for kind in ("glsl", "assets"):
        files = [path for path in (ROOT / kind).rglob("*") if path.is_file() and "__pycache__" not in path.parts]
        assert files
        assert {f"app/_data/{path.relative_to(ROOT).as_posix()}" for path in files} <= inside
    assert not [name for name in inside if name.split("/")[0] not in {"app"} and ".dist-info/" not in name]


def test_the_installed_copy_renders_with_its_own_shaders(installed: Path, tmp_path: Path) -> None:
    where = "from app.data import data_dir; print(data_dir('glsl'))"
    assert Path(run("-c", where, cwd=tmp_path, PYTHONPATH=str(installed)).strip()).is_relative_to(installed)

    shot = ("-m", "app", "shot", "still-life", "--view", "sharp", "--size", "64x36", "-o", "x.png")
    run(*shot, cwd=tmp_path, PYTHONPATH=str(installed))
    pixels = np.asarray(Image.open(tmp_path / "x.png").convert("RGB"))
    assert pixels.shape == (36, 64, 3)
    assert pixels.mean() > 8, "the picture is black"
    assert pixels.std() > 8, "the picture is one colour"
