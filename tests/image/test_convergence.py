"""The ray-traced view converges as fast as its samples allow, and does not stop: against truth in float64."""

from __future__ import annotations

import math

import moderngl
import numpy as np
import pytest
from scipy.integrate import quad_vec

from app.camera import Camera
from app.measure.metrics import rmse
from app.optics import coc_px, coc_scale_px
from app.scene.model import Material

from ..gpu.small_scenes import quad, scene_of
from . import half_plane as near_edge
from . import occluders
from .stage import Stage, stage_of

SOLIDS_SIZE = (48, 27)
COUNTS = (1, 2, 4, 8, 16, 32, 64)  # samples

SIZE = (16, 9)
EDGE_X_PX = 7.3  # where the pinhole sees the wall's edge
WALL_DEPTH, FOCUS, APERTURE = 1.5, 4.0, 1.0  # m: a CoC radius of 2.6 px
WALL, BACKGROUND = 0.9, 0.1
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(40))


def half_plane(ctx: moderngl.Context) -> Stage:
    """A wall that fills the right of the picture up to a vertical edge, in front of focus."""
    per_pixel = 2 * WALL_DEPTH * math.tan(CAMERA.fov_y / 2) / SIZE[1]
    edge = (EDGE_X_PX - SIZE[0] / 2) * per_pixel
    wall = quad((edge, -50, -WALL_DEPTH), (100, 0, 0), (0, 100, 0))
    scene = scene_of([wall], [Material(base_color=(WALL, WALL, WALL, 1.0))])
    lens = {"lens__aperture": APERTURE, "lens__focus_distance": FOCUS}
    return stage_of(ctx, scene, CAMERA, shading__mode="unlit", shading__background=[BACKGROUND] * 3, **lens)


def edge_truth() -> np.ndarray:
    """Radiance (w,) of each pixel column: the disc's share beyond the edge, integrated over the pixel, in float64."""
    scale = coc_scale_px(APERTURE, SIZE[1], CAMERA.fov_y)
    radius = abs(float(coc_px(WALL_DEPTH, scale, 1 / FOCUS)))
    columns = np.arange(SIZE[0], dtype=np.float64)

    def share(offset: float) -> np.ndarray:
        t = np.clip((columns + offset - EDGE_X_PX) / radius, -1.0, 1.0)
        return 0.5 + (t * np.sqrt(1.0 - t * t) + np.arcsin(t)) / math.pi

    covered, _ = quad_vec(share, 0.0, 1.0, epsabs=1e-10)
    return np.asarray(BACKGROUND + (WALL - BACKGROUND) * covered)


def test_the_mean_keeps_converging_to_the_last_sample(ctx: moderngl.Context, soak: bool) -> None:
    stage, last = half_plane(ctx), 65536 if soak else 16384
    truth = np.broadcast_to(edge_truth()[None, :, None], (SIZE[1], SIZE[0], 3))
    errors = {n: rmse(stage.linear("traced", SIZE, spp=n), truth) for n in (256, last // 4, last)}
    # Owen-scrambled points err as n^-3/4 at best, n^-1/2 at worst (Owen 1997); a mean that stalls does not fall.
    print(f"root mean square error by samples a pixel: {errors}")
    assert errors[last // 4] <= errors[256] / 4
    assert errors[last] <= errors[last // 4] / 2
    assert stage.renderer.converged_samples == last


def test_many_equal_samples_do_not_drift(ctx: moderngl.Context, soak: bool) -> None:
    stage = half_plane(ctx)
    picture = stage.linear("traced", SIZE, spp=65536 if soak else 16384)
    right = picture[:, -1]
    np.testing.assert_allclose(right, WALL, rtol=2.0**-23)  # wholly on the wall: each sample is the same float32


@pytest.fixture(scope="module")
def solids(ctx) -> tuple[Stage, np.ndarray]:
    """Occluded solids, and their converged picture at SOLIDS_SIZE."""
    lens = {"lens__aperture": occluders.APERTURE, "lens__focus_distance": occluders.FOCUS}
    stage = stage_of(ctx, occluders.scene(), occluders.CAMERA, shading__mode="unlit", **lens)
    return stage, stage.linear("traced", SOLIDS_SIZE, spp=4096, seed=1)


def slope(errors: list[float]) -> float:
    """Of the straight line through log error over log COUNTS."""
    return float(np.polyfit(np.log(COUNTS), np.log(errors), 1)[0])


def test_independent_samples_err_with_the_inverse_square_root_of_their_number(solids: tuple[Stage, np.ndarray]) -> None:
    """Pictures of one sample each, every one with its own seed: no bias and no correlation between seeds, which a
    reference's noise floor rests on. Either would bend the line.
    """
    stage, truth = solids
    singles = stage.runs("traced", SOLIDS_SIZE, 1, range(2, 2 + COUNTS[-1]))
    errors = [rmse(singles[:n].mean(0), truth) for n in COUNTS]
    assert abs(slope(errors) + 0.5) < 0.05, f"slope {slope(errors):.3f}: {errors}"


def test_samples_of_one_sequence_err_less_than_independent_ones(solids: tuple[Stage, np.ndarray]) -> None:
    """Owen-scrambled Sobol points are stratified over lens and pixel: the error falls faster than by 1 / sqrt(n)."""
    stage, truth = solids
    errors = [rmse(stage.linear("traced", SOLIDS_SIZE, spp=n, seed=2), truth) for n in COUNTS]
    assert slope(errors) <= -0.6, f"slope {slope(errors):.3f}: {errors}"


def test_a_biased_view_stops_at_its_bias(ctx) -> None:
    """The pinhole picture and the post-process have settled after 16 frames; tracing goes on, past both of them."""
    stage = near_edge.half_plane(ctx)
    truth = stage.linear("traced", near_edge.SIZE, spp=4096, seed=1)

    def errors(view: str) -> list[float]:
        return [rmse(stage.linear(view, near_edge.SIZE, frames=n, spp=n, seed=2), truth) for n in (16, 64)]

    traced = errors("traced")
    assert traced[1] < traced[0] / 2  # 4 ** -0.5, at the slowest
    for view in ("sharp", "post"):
        early, late = errors(view)
        assert late > 0.9 * early
        assert late > 2 * traced[1]
