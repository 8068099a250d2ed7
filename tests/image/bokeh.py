"""A small bright quad out of focus, on black: its picture is the lens, whose moments are known in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import moderngl
import numpy as np

from app.camera import Camera
from app.optics import coc_px, coc_scale_px
from app.scene.model import Material

from ..gpu.small_scenes import quad, scene_of
from .stage import Stage, stage_of

SIZE = (96, 72)
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(40))
FOCUS, APERTURE = 2.0, 0.6  # m
RADIANCE = 20.0  # bright enough that its bokeh stays above 1
SIDE_PX = 6.0  # of the quad's sharp picture
CENTRE_PX = (50.4, 33.7)  # from the bottom left: nowhere special in its pixel
DEPTHS = {"near": 1.15, "far": 12.0}  # m: CoC radii of 11.0 and 12.4 px


def stage(ctx: moderngl.Context, depth: float, **settings: object) -> Stage:
    """The quad at planar depth `depth` [m], of the same sharp size and place at every depth."""
    metre = SIZE[1] / (2 * depth * math.tan(CAMERA.fov_y / 2))  # px per metre
    x, y = ((CENTRE_PX[i] - SIZE[i] / 2 - SIDE_PX / 2) / metre for i in (0, 1))
    light = quad((x, y, -depth), (SIDE_PX / metre, 0, 0), (0, SIDE_PX / metre, 0))
    material = Material(base_color=(0.0, 0.0, 0.0, 1.0), emissive=(RADIANCE, RADIANCE / 2, RADIANCE / 4))
    lens = {
        "lens__aperture": APERTURE,
        "lens__focus_distance": FOCUS,
        "shading__mode": "unlit",
        "shading__background": [0.0] * 3,
        "post__max_coc": 0.3,
    }
    return stage_of(ctx, scene_of([light], [material]), CAMERA, **(lens | settings))


def coc_radius(depth: float) -> float:
    """Signed CoC radius [px]."""
    return float(coc_px(depth, coc_scale_px(APERTURE, SIZE[1], CAMERA.fov_y), 1 / FOCUS))


@dataclass(frozen=True)
class Moments:
    """A bokeh's energy [radiance px^2], centroid [px from the bottom left] and variance along x and y [px^2]."""

    energy: float
    centroid: np.ndarray
    variance: np.ndarray


def moments(picture: np.ndarray) -> Moments:
    """Of a linear picture (h, w, 3), top row first; the red channel."""
    light = picture[::-1, :, 0]
    y, x = np.indices(light.shape) + 0.5
    energy = float(light.sum())
    at = np.stack([x, y])
    centroid = (at * light).sum((1, 2)) / energy
    variance = ((at - centroid[:, None, None]) ** 2 * light).sum((1, 2)) / energy
    return Moments(energy, centroid, variance)


def expected(depth: float, blades: int = 0, anamorphic: float = 1.0, aberration: float = 0.0) -> Moments:
    """Closed form: the quad's square convolved with the aperture scaled by the CoC radius; a pixel adds its own square.

    Mean square radius of a disc whose enclosed-area fraction t has density 1 + s (2t - 1): 1/2 + s/6; of a regular
    n-gon in the unit circle: (2 + cos(2 pi / n)) / 6. Each axis has half of it, over the squeeze's square in x.
    """
    mean_square = (2 + math.cos(2 * math.pi / blades)) / 6 if blades >= 3 else 0.5 + aberration / 6
    lens = coc_radius(depth) ** 2 * mean_square / 2 / np.array([anamorphic**2, 1.0])
    squares = (SIDE_PX**2 + 1.0) / 12
    return Moments(RADIANCE * SIDE_PX**2, np.array(CENTRE_PX), lens + squares)


def sixfold(picture: np.ndarray) -> complex:
    """Sixth angular moment about the centroid: 1 for six arms, one of them to the right; -1 if turned by 30 degrees."""
    light, about = picture[::-1, :, 0], moments(picture).centroid
    y, x = np.indices(light.shape) + 0.5
    arm = (x - about[0]) + 1j * (y - about[1])
    return complex((light * arm**6).sum() / (light * np.abs(arm) ** 6).sum())


def covered(picture: np.ndarray, share: float = 0.25) -> np.ndarray:
    """Pixels (h, w) brighter than a share of the bokeh's 90th percentile: the disc without its soft rim."""
    light = picture[..., 0]
    return np.asarray(light > share * np.percentile(light[light > 0.05], 90))
