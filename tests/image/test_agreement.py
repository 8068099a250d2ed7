"""The ray-traced view against two renderers that share none of its visibility code: our rasteriser, and Mitsuba 3."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.measure.metrics import mean_flip

from . import mitsuba_scene, occluders
from .stage import Stage, opened, stage_of, with_settings
from .statistics import HALF_EPSILON, assert_same_expectation

RUNS = 16
RASTER_SEEDS = range(100, 100 + RUNS)
ROOM = "greywhite_room.glb"
RASTER_SIZE, RASTER_SPP = (96, 54), 16
MITSUBA_SIZE, MITSUBA_SPP = (77, 45), 128  # neither even nor 16:9
RASTER_AGAINST_MITSUBA_SPP = 32

#: Base colour and lit radiance pass through a float16 each on their way through the G-buffer.
GBUFFER_ROUNDING = 2 * HALF_EPSILON

#: Mitsuba adds the samples of a pixel up in float32: each addition may round by half an ulp of the sum.
SUM_ROUNDING = MITSUBA_SPP * 2.0**-24

FLIP_NOISE = 1.1  # FLIP between two pictures of the same noise is itself noisy: some 5 % for these sizes
FLIP_TARGET = 0.01  # at 512 samples: what the project promises for its references
FLIP_SAMPLES = 512


def assert_flip_is_noise(a: np.ndarray, b: np.ndarray) -> None:
    """Runs a and b (n, h, w, 3) differ, to the eye, as two pictures of a, or two of b, with as many samples do."""
    half = len(a) // 2
    parts = [runs.mean(0) for runs in (a[:half], a[half:], b[:half], b[half:])]
    own = np.hypot(mean_flip(parts[0], parts[1]), mean_flip(parts[2], parts[3])) / np.sqrt(2.0)
    across = np.mean([mean_flip(parts[i], parts[j]) for i in (0, 1) for j in (2, 3)])
    assert across <= FLIP_NOISE * own, f"FLIP {across:.4f} between the renderers, {own:.4f} within each"


def flip_at(samples: int, a: np.ndarray, b: np.ndarray, samples_per_run: int) -> float:
    """FLIP between the pictures at another number of samples, along the power law that halving the samples shows."""
    half = len(a) // 2
    whole = mean_flip(a.mean(0), b.mean(0))
    parts = np.mean([mean_flip(x.mean(0), y.mean(0)) for x in (a[:half], a[half:]) for y in (b[:half], b[half:])])
    octaves = np.log2(samples / (len(a) * samples_per_run))
    return float(whole * (whole / parts) ** octaves)


@pytest.fixture(scope="module")
def solids(ctx) -> Stage:
    lens = {"lens__aperture": occluders.APERTURE, "lens__focus_distance": occluders.FOCUS}
    background = list(occluders.BACKGROUND)
    return stage_of(
        ctx, occluders.scene(), occluders.CAMERA, shading__mode="unlit", shading__background=background, **lens
    )


@pytest.fixture(scope="module")
def mitsuba_runs(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    scene = mitsuba_scene.load(MITSUBA_SIZE, tmp_path_factory.mktemp("ply"))
    return mitsuba_scene.runs(scene, MITSUBA_SPP, range(RUNS))


def test_rays_agree_with_mitsuba(solids: Stage, mitsuba_runs: np.ndarray) -> None:
    traced = solids.runs("traced", MITSUBA_SIZE, MITSUBA_SPP, range(RUNS))
    assert_same_expectation(traced, mitsuba_runs, rounding=SUM_ROUNDING)


def test_the_raster_reference_agrees_with_mitsuba(solids: Stage, mitsuba_runs: np.ndarray) -> None:
    raster = solids.runs("reference", MITSUBA_SIZE, RASTER_AGAINST_MITSUBA_SPP, RASTER_SEEDS)
    assert_same_expectation(raster, mitsuba_runs, rounding=GBUFFER_ROUNDING)


@pytest.mark.parametrize("path", ["lens__aperture", "lens__focus_distance"])
def test_the_test_sees_a_lens_that_is_slightly_wrong(solids: Stage, mitsuba_runs: np.ndarray, path: str) -> None:
    wrong = {"lens__aperture": 1.05 * occluders.APERTURE, "lens__focus_distance": 1.03 * occluders.FOCUS}
    settings = with_settings(solids.settings, {path: wrong[path]})
    pictures = solids.runs("traced", MITSUBA_SIZE, MITSUBA_SPP, range(RUNS), settings=settings)
    with pytest.raises(AssertionError, match=r"beyond the|times their noise|systematically"):
        assert_same_expectation(pictures, mitsuba_runs, rounding=SUM_ROUNDING)


def test_rays_agree_with_the_rasteriser_on_the_lit_default_scene(ctx) -> None:
    stage = opened(ctx, "still-life")
    traced = stage.runs("traced", RASTER_SIZE, RASTER_SPP, range(RUNS))
    raster = stage.runs("reference", RASTER_SIZE, RASTER_SPP, RASTER_SEEDS)
    assert_same_expectation(traced, raster, rounding=GBUFFER_ROUNDING)
    assert_flip_is_noise(traced, raster)


@pytest.mark.parametrize("camera", ["greywhite_room.json", "greywhite_room_plant.json"])
def test_rays_agree_with_the_rasteriser_in_a_real_room(ctx, shared_scenes: Path, camera: str) -> None:
    stage = opened(ctx, str(shared_scenes / ROOM), shared_scenes / camera, unlit=True)
    traced = stage.runs("traced", RASTER_SIZE, RASTER_SPP, range(RUNS))
    raster = stage.runs("reference", RASTER_SIZE, RASTER_SPP, RASTER_SEEDS)
    assert_same_expectation(traced, raster, rounding=GBUFFER_ROUNDING)
    assert_flip_is_noise(traced, raster)
    assert flip_at(FLIP_SAMPLES, traced, raster, RASTER_SPP) <= FLIP_TARGET
