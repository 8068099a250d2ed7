"""Still pixels that are settled get no more rays, and look as if they had: the noise they keep is one that no display
shows.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
import pytest

from app.camera import Moment
from app.renderer import Renderer
from app.settings import Settings, put

from .stage import Stage, opened

SIZE, FRAMES = (80, 45), 40
LEVEL = 1.0 / 255.0  # of the ray mask: settled pixels lie between 0 and this
STEP = 0.5  # of 255: the standard error that a settled pixel may keep


def settled(renderer: Renderer) -> np.ndarray:
    """Half-resolution pixels (h, w), top row first, that keep their light without rays."""
    weight = renderer.read("mask")[::-1, :, 0]
    return (weight > 0.0) & (weight < 0.5 * LEVEL)


@dataclass
class Still:
    """A still picture (h, w, 3) of 0..255, the rays of every fourth frame, settled and masked half-res pixels."""

    picture: np.ndarray
    rays: list[float]
    settled: np.ndarray
    masked: np.ndarray


def blurred(stage: Stage) -> Settings:
    """Wide open, so that so small a picture has blur, and with many rays a frame."""
    return put(put(stage.settings, "lens.aperture", 0.1), "rays.budget", 16.0)


def still(stage: Stage, settle: bool) -> Still:
    settings = put(blurred(stage), "mask.settle", settle)
    moments, rays = [Moment(stage.camera, 0.0)] * FRAMES, []
    for frame, renderer in enumerate(stage.frames("hybrid", SIZE, moments, settings=settings)):
        if frame % 4 == 3:
            rays.append(float(renderer.read("ray_count")[..., 0].sum()))
    masked = stage.renderer.read("mask")[::-1, :, 0] > 0.0
    return Still(stage.renderer.picture().astype(float), rays, settled(stage.renderer), masked)


@pytest.fixture(scope="module")
def pair(ctx: moderngl.Context) -> tuple[Still, Still]:
    """Drawn with rays for all, and with rays for those that need some."""
    stage = opened(ctx, "still-life")
    return still(stage, False), still(stage, True)


def test_rays_are_for_those_that_need_them(pair: tuple[Still, Still]) -> None:
    every, some = pair
    assert not every.settled.any()
    assert some.settled.any()
    assert some.rays[0] == every.rays[0], "none is settled by 64 rays"
    share = some.settled.sum() / some.masked.sum()
    assert some.rays[-1] / every.rays[-1] == pytest.approx(1.0 - share, abs=0.02), "the others get no more for it"


def test_no_display_shows_what_is_missing(pair: tuple[Still, Still]) -> None:
    """Both pictures err independently by the noise that is allowed, or less: the root of two times as much."""
    every, some = pair
    full = np.repeat(np.repeat(some.settled, 2, 0), 2, 1)[: SIZE[1], : SIZE[0]]
    apart = (every.picture - some.picture)[full]
    assert abs(apart.mean()) < 0.5 * STEP, "it is noise: neither picture is brighter"
    assert np.sqrt((apart**2).mean()) < np.sqrt(2.0) * STEP + np.sqrt(1 / 12), "and that of rounding to 8 bits"


def test_what_moves_is_never_settled(ctx: moderngl.Context) -> None:
    stage = opened(ctx, "still-life")
    moments = [Moment(stage.camera, 0.0)] * FRAMES + [Moment(stage.camera.moved(0.01, 0.0, 0.0), 0.0)] * 2
    settings = blurred(stage)
    counts = [settled(renderer).sum() for renderer in stage.frames("hybrid", SIZE, moments, settings=settings)]
    assert counts[FRAMES - 1] > 0
    assert counts[FRAMES] == 0, "the frame of the move"
