"""A small bright quad out of focus, on black: its picture is the lens, whose moments are known in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import moderngl
import numpy as np

from app.camera import Camera
from app.optics import barrel_shift, coc_px, coc_scale_px, lens_point, lens_spread, passes_barrel
from app.sampling import sobol4
from app.scene.model import Material

from ..gpu.small_scenes import quad, scene_of
from .stage import Stage, stage_of

SIZE = (144, 108)
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(40))
FOCUS = 2.0  # m
RADIANCE = 20.0  # bright enough that its bokeh stays above 1 up to a radius of 12 px
SIDE_PX = 6.0  # of the quad's sharp picture
CENTRE_PX = (76.4, 50.7)  # from the bottom left: nowhere special in its pixel
CORNER_PX = (112.4, 80.7)  # as far towards the top right as a radius of 20 px leaves room: 0.52 of the half diagonal
DEPTHS = {"near": 1.15, "far": 12.0}  # m


@dataclass(frozen=True)
class Light:
    """The quad in front of or behind focus (`side`: a key of DEPTHS), blurred to a circle of `radius_px`."""

    side: str
    radius_px: float = 12.0
    centre_px: tuple[float, float] = CENTRE_PX

    @property
    def coc_px(self) -> float:
        """Signed."""
        return self.radius_px if self.side == "far" else -self.radius_px

    @property
    def aperture(self) -> float:
        """Of the lens that blurs it so [m]."""
        of_a_metre = float(coc_px(DEPTHS[self.side], coc_scale_px(1.0, SIZE[1], CAMERA.fov_y), 1.0 / FOCUS))
        return self.coc_px / of_a_metre


def stage(ctx: moderngl.Context, light: Light, **settings: object) -> Stage:
    """The quad, of the same sharp size and place at every depth."""
    depth = DEPTHS[light.side]
    metre = SIZE[1] / (2 * depth * math.tan(CAMERA.fov_y / 2))  # px per metre
    x, y = ((light.centre_px[i] - SIZE[i] / 2 - SIDE_PX / 2) / metre for i in (0, 1))
    emitter = quad((x, y, -depth), (SIDE_PX / metre, 0, 0), (0, SIDE_PX / metre, 0))
    material = Material(base_color=(0.0, 0.0, 0.0, 1.0), emissive=(RADIANCE, RADIANCE / 2, RADIANCE / 4))
    lens = {
        "lens__aperture": light.aperture,
        "lens__focus_distance": FOCUS,
        "shading__mode": "unlit",
        "shading__background": [0.0] * 3,
        "post__max_coc": 0.3,
    }
    return stage_of(ctx, scene_of([emitter], [material]), CAMERA, **(lens | settings))


@dataclass(frozen=True)
class Moments:
    """A bokeh's energy [radiance px^2], centroid [px from the bottom left] and covariance [px^2]."""

    energy: float
    centroid: np.ndarray
    covariance: np.ndarray

    @property
    def area(self) -> float:
        """Of the uniform ellipse that spreads as wide [px^2]: unlike a count of bright pixels or (sum L)^2 / sum L^2 it
        does not grow where a rim is drawn softer about the same place.
        """
        return 4.0 * math.pi * math.sqrt(float(np.linalg.det(self.covariance)))


def moments(picture: np.ndarray) -> Moments:
    """Of a linear picture (h, w, 3), top row first; the red channel."""
    light = picture[::-1, :, 0]
    y, x = np.indices(light.shape) + 0.5
    return weighted(np.stack([x, y], -1).reshape(-1, 2), light.ravel())


def weighted(points: np.ndarray, weights: np.ndarray) -> Moments:
    """Of points (n, 2) [px] with weights (n,)."""
    energy = float(weights.sum())
    centroid = (points * weights[:, None]).sum(0) / energy
    off = points - centroid
    return Moments(energy, centroid, (off * weights[:, None]).T @ off / energy)


def expected(light: Light, blades: int = 0, anamorphic: float = 1.0, aberration: float = 0.0) -> Moments:
    """Closed form: the quad's square convolved with the aperture scaled by the CoC radius; a pixel adds its own square.

    Each axis has half of the lens' mean square radius, over the squeeze's square in x.
    """
    along = light.radius_px**2 * lens_spread(blades, 1.0, aberration) / 2 / np.array([anamorphic**2, 1.0])
    squares = (SIDE_PX**2 + 1.0) / 12
    return Moments(RADIANCE * SIDE_PX**2, np.array(light.centre_px), np.diag(along + squares))


def expected_cut(light: Light, cat_eye: float, blades: int = 0) -> Moments:
    """With a barrel: each of the light's points sends each lens point's share to its place in the picture, where it
    counts if the barrel, seen from there, lets it pass, over the share of the lens that passes there.
    """
    samples = sobol4(np.arange(1 << 14), 5)
    lens = lens_point(samples[:, :2], blades)
    places = np.array(light.centre_px) + SIDE_PX * (samples[:, 2:] - 0.5) + light.coc_px * lens
    shifts = barrel_shift(places, SIZE, cat_eye)
    passing = passes_barrel(lens, shifts)
    open_share = np.array([passes_barrel(lens[:1024], shift).mean() for shift in shifts[passing]])
    found = weighted(places[passing], RADIANCE * SIDE_PX**2 / len(lens) / open_share)
    return Moments(found.energy, found.centroid, found.covariance + np.eye(2) / 12)


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
