"""How well the two ground truths agree: `python -m tests.image.agreement SCENE [CAMERA.json] --spp 512 --size 640x360`.

Prints mean FLIP between `traced` and `reference`, the noise floor of each (at most what two runs of it with as many
samples differ by), and seconds.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from app.gpu.context import device_name, headless_context
from app.measure.metrics import mean_flip

from .options import size
from .stage import Stage, opened

VIEWS = ("traced", "reference")


def halves(stage: Stage, view: str, picture_size: tuple[int, int], spp: int) -> tuple[np.ndarray, float]:
    """Two independent pictures (2, h, w, 3) of spp / 2 samples each, and the seconds they took."""
    begin = time.perf_counter()
    seeds = (0, 1) if view == "traced" else (2, 3)
    return stage.runs(view, picture_size, spp // 2, seeds), time.perf_counter() - begin


def flip_of_noise(first_half: np.ndarray, second_half: np.ndarray) -> float:
    """What two independent pictures with the samples of both halves together would differ by.

    The halves differ by this times a factor between sqrt(2), the noise's own, and 1, where FLIP saturates: dividing by
    sqrt(2) never overstates it.
    """
    return mean_flip(first_half, second_half) / np.sqrt(2.0)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.image.agreement", description=__doc__)
    parser.add_argument("scene", help="built-in name or file")
    parser.add_argument("camera", nargs="?", type=Path, help="camera file; the scene's own camera otherwise")
    parser.add_argument("--spp", type=int, default=512, help="samples per pixel of each picture, even")
    parser.add_argument("--size", type=size, default=(640, 360))
    parser.add_argument("--unlit", action="store_true", help="base colour on a background of 0.5, 0.6, 0.7")
    options = parser.parse_args(arguments)
    ctx = headless_context()
    stage = opened(ctx, options.scene, options.camera, options.unlit)
    stage.draw("traced", (8, 8))  # the tree is built and both programs are compiled before anything is timed
    stage.draw("reference", (8, 8))
    pictures = {view: halves(stage, view, options.size, options.spp) for view in VIEWS}
    means = [pair.mean(0) for pair, _ in pictures.values()]
    print(
        f"{options.scene} {options.camera or ''} {options.size[0]}x{options.size[1]}, "
        f"{options.spp} samples per pixel, on {device_name(ctx)}"
    )
    print(f"FLIP traced against reference: {mean_flip(*means):.4f}")
    for view, (pair, seconds) in pictures.items():
        print(
            f"{view}: noise floor {flip_of_noise(*pair):.4f}, {seconds:.1f} s, "
            f"mean radiance {np.array2string(pair.mean((0, 1, 2)), precision=5)}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
