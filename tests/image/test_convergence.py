"""The ray-traced view converges as fast as its samples allow, and does not stop: float64 truth, 16 384 samples."""

from __future__ import annotations

import math

import moderngl
import numpy as np
from scipy.integrate import quad_vec

from app.camera import Camera
from app.optics import coc_px, coc_scale_px
from app.scene.model import Material

from ..gpu.small_scenes import quad, scene_of
from . import occluders
from .stage import Stage, stage_of

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


def rms(picture: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((picture - truth) ** 2)))


def test_the_mean_keeps_converging_past_sixteen_thousand_samples(ctx) -> None:
    stage, truth = half_plane(ctx), edge_truth()[None, :, None]
    errors = {n: rms(stage.linear("traced", SIZE, spp=n), truth) for n in (256, 4096, 16384)}
    # Owen-scrambled points err as n^-3/4 at best, n^-1/2 at worst (Owen 1997); a mean that stalls does not fall.
    assert errors[4096] <= errors[256] / 4
    assert errors[16384] <= errors[4096] / 2
    assert stage.renderer.converged_samples == 16384


def test_many_equal_samples_do_not_drift(ctx) -> None:
    stage = half_plane(ctx)
    picture = stage.linear("traced", SIZE, spp=16384)
    right = picture[:, -1]
    np.testing.assert_allclose(right, WALL, rtol=2.0**-23)  # wholly on the wall: each sample is the same float32


def test_error_falls_at_least_with_the_square_root_of_the_samples(ctx) -> None:
    lens = {"lens__aperture": occluders.APERTURE, "lens__focus_distance": occluders.FOCUS}
    stage = stage_of(ctx, occluders.scene(), occluders.CAMERA, shading__mode="unlit", **lens)
    size, counts = (48, 27), (1, 2, 4, 8, 16, 32, 64)
    truth = stage.linear("traced", size, spp=4096, seed=1)
    errors = [rms(stage.linear("traced", size, spp=n, seed=2), truth) for n in counts]
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope <= -0.5, f"slope {slope:.2f}: {errors}"
