"""The golden pictures: what is drawn, and how much of it may change unnoticed. The README shows the same files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
from PIL import Image

from app.settings import to_dict

from . import comparison
from .stage import opened

ROOT = Path(__file__).parents[2]
SCREENSHOTS = ROOT / "screenshots"
DIFFERENCES = Path(__file__).parent / "diff"

LEVELS = 3  # of 255: a software rasteriser differs in its low bits between processors, and sRGB steepens the dark
AMPLIFIED = 8  # how much brighter the difference picture shows a difference

Picture = np.ndarray  # (h, w, 3) uint8 sRGB, top row first


@dataclass(frozen=True)
class Tolerance:
    """The share of pixels that may differ by more than LEVELS, and how many levels all may differ by on average."""

    share: float
    mean: float


STEADY = Tolerance(share=0.003, mean=0.1)  # a rasterised edge may move by a bit, a texel by a rounding
# where a ray passes an edge on the other side, a bright highlight makes one pixel of it
SAMPLED = Tolerance(share=0.01, mean=0.25)


@dataclass(frozen=True)
class Golden:
    """One picture of a built-in scene."""

    name: str
    view: str
    meaning: str  # the README's caption
    size: tuple[int, int] = (640, 360)
    frames: int = 16
    spp: int = 1
    tolerance: Tolerance = STEADY
    scene: str = "still-life"
    time_s: float = 0.0  # when, in a scene that moves


@dataclass(frozen=True)
class Composed:
    """A picture made of golden ones."""

    name: str
    parts: tuple[str, ...]
    compose: Callable[[list[Picture]], Picture]
    meaning: str
    tolerance: Tolerance = STEADY  # text is drawn by whichever FreeType Pillow brings


SMALL = (320, 180)

GOLDENS = (
    Golden("sharp", "sharp", "what a pinhole sees"),
    Golden("post", "post", "depth of field as a post-process"),
    Golden("hybrid", "hybrid", "the same with rays where the image lacks what the lens sees", tolerance=SAMPLED),
    Golden("traced", "traced", "ground truth: rays through every part of the lens", spp=64, tolerance=SAMPLED),
    Golden("coc", "coc", "circles of confusion: near in one colour, far in the other", size=SMALL, frames=1),
    Golden("mask", "mask", "how the hybrid view shares out its rays", size=SMALL, frames=4, tolerance=SAMPLED),
    Golden("train-post", "post", "a moving scene as a post-process", scene="toy-train", time_s=0.8),
    Golden("train-hybrid", "hybrid", "and as the hybrid", scene="toy-train", time_s=0.8, tolerance=SAMPLED),
    Golden("train-traced", "traced", "and traced", scene="toy-train", time_s=0.8, spp=64, tolerance=SAMPLED),
)
COMPOSED = (
    Composed("comparison", ("post", "hybrid", "traced"), comparison.still_life, "a blurred silhouette, three ways"),
    Composed(
        "train-comparison",
        ("train-post", "train-hybrid", "train-traced"),
        comparison.toy_train,
        "lights behind a blurred wheel, three ways",
    ),
)


def render(ctx: moderngl.Context, golden: Golden) -> tuple[Picture, dict[str, object]]:
    """The picture as it is drawn now, and the metadata that `hybrid-dof shot` would give it."""
    stage = opened(ctx, golden.scene)
    drawn = stage.draw(golden.view, golden.size, frames=golden.frames, spp=golden.spp, time_s=golden.time_s)
    picture = drawn.picture()
    facts = {
        "scene": golden.scene,
        "time": golden.time_s,
        "view": golden.view,
        "size": list(golden.size),
        "seed": 0,
        "settings": to_dict(stage.settings),
    }
    return picture, {**facts, "samples": stage.renderer.converged_samples}


def path_of(name: str) -> Path:
    return SCREENSHOTS / f"{name}.png"


def stored(name: str) -> Picture | None:
    """The approved picture, or None before its first approval."""
    path = path_of(name)
    return np.asarray(Image.open(path).convert("RGB")) if path.exists() else None


def difference(expected: Picture, actual: Picture) -> Tolerance:
    """How far apart two pictures of the same size are, as the tolerance that would just allow it."""
    levels = np.abs(expected.astype(int) - actual.astype(int))
    return Tolerance(share=float((levels.max(-1) > LEVELS).mean()), mean=float(levels.mean()))


def within(found: Tolerance, allowed: Tolerance) -> bool:
    return found.share <= allowed.share and found.mean <= allowed.mean


def described(found: Tolerance) -> str:
    return f"{found.share:.2%} of the pixels differ by more than {LEVELS}/255, all by {found.mean:.2f}/255 on average"


def write_difference(name: str, expected: Picture, actual: Picture) -> Path:
    """Expected, actual and amplified difference side by side; returns where."""
    levels = np.abs(expected.astype(int) - actual.astype(int)) * AMPLIFIED
    DIFFERENCES.mkdir(exist_ok=True)
    path = DIFFERENCES / f"{name}.png"
    Image.fromarray(np.concatenate([expected, actual, levels.clip(0, 255).astype(np.uint8)], 1)).save(path)
    return path


def assert_golden(name: str, actual: Picture, allowed: Tolerance) -> None:
    """Fails with what differs and where to look. The approved picture is never written here."""
    expected = stored(name)
    assert expected is not None, (
        f"{path_of(name)} does not exist: look at the picture and run `make approve ARGS={name}`"
    )
    assert expected.shape == actual.shape, (
        f"{name} is {actual.shape[1]}x{actual.shape[0]}, its golden {expected.shape[1]}x{expected.shape[0]}"
    )
    found = difference(expected, actual)
    if not within(found, allowed):
        path = write_difference(name, expected, actual)
        raise AssertionError(
            f"{name}: {described(found)}; see {path}, and if it is meant, run `make approve ARGS={name}`"
        )
