"""The barrel changes the shape of blur only: a flat surface, blurred or in focus, keeps its radiance in every view."""

from __future__ import annotations

import math

import moderngl
import numpy as np
import pytest

from app.camera import Camera
from app.frame.pipeline import CONVERGING, VIEWS
from app.scene.model import Material

from ..gpu.small_scenes import quad, scene_of
from .stage import stage_of

SIZE = (67, 41)  # no multiple of a work group, a tile or two
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(40))
COLOR = (0.75, 0.3, 0.5)
F16 = 2.0**-10  # relative spacing of float16
ROUNDINGS = {"sharp": 2, "post": 5, "hybrid": 8, "traced": 1, "reference": 2}  # to float16, through the passes


@pytest.mark.parametrize(
    "lens", [{}, {"lens__blades": 5}, {"lens__anamorphic": 3.0, "lens__spherical_aberration": 0.9}]
)
@pytest.mark.parametrize("depth", [1.0, 1.7, 2.0, 2.2, 6.0])
@pytest.mark.parametrize("view", VIEWS)
def test_a_flat_surface_keeps_its_radiance(
    ctx: moderngl.Context, view: str, depth: float, lens: dict[str, object]
) -> None:
    wall = quad((-20.0, -20.0, -depth), (40.0, 0.0, 0.0), (0.0, 40.0, 0.0))
    background = {"shading__mode": "unlit", "shading__background": [9.0] * 3}
    optics = {"lens__aperture": 0.4, "lens__focus_distance": 2.0, "lens__cat_eye": 1.0, "post__max_coc": 0.3}
    stage = stage_of(ctx, scene_of([wall], [Material((*COLOR, 1.0))]), CAMERA, **background, **optics, **lens)
    frames = 16 if view in CONVERGING else 2
    picture = stage.linear(view, SIZE, frames=frames, spp=frames)
    assert np.abs(picture / COLOR - 1.0).max() <= ROUNDINGS[view] * F16


def test_no_pixel_waits_for_a_lens_point_that_passes(ctx: moderngl.Context) -> None:
    """The first frames of the raster reference show something in every pixel, and each traced sample counts."""
    wall = quad((-20.0, -20.0, -6.0), (40.0, 0.0, 0.0), (0.0, 40.0, 0.0))
    stage = stage_of(ctx, scene_of([wall], [Material((*COLOR, 1.0))]), CAMERA, lens__cat_eye=1.0, shading__mode="unlit")
    assert stage.linear("reference", SIZE, spp=1).min() > 0.0
    renderer = stage.draw("traced", SIZE, spp=8)
    assert (renderer.read("traced")[..., 3] == 8).all()
    assert renderer.read("traced_error")[..., 3].max() > 8
