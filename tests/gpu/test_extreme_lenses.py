"""Every view through the oddest lenses that settings allow: finite, never negative, and the same in the limits."""

from __future__ import annotations

import math
from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from app.camera import FOV_Y_DEG, Camera
from app.frame.pipeline import VIEWS
from app.scene.facts import frame_facts
from app.scene.model import Material
from app.settings import Lens, Settings, put

from ..image.stage import Stage, stage_of
from .small_scenes import quad, scene_of

SIZE = (48, 27)
HALF = 2.0**-10  # relative, of one conversion to float16: OpenGL leaves its rounding open, and llvmpipe truncates
BLURRED = ("post", "hybrid", "traced", "reference")
LEAF_M = 0.003  # a hair beyond the near plane of a scene half a metre wide

# aperture [m], focus distance [m], vertical field of view [degrees]
LENSES = {
    "pinhole": (0.0, 3.0, 50.0),
    "a micrometre": (1e-6, 3.0, 50.0),
    "denormal aperture": (1e-42, 3.0, 50.0),
    "wider than its focus distance": (1.0, 0.1, 50.0),
    "focus before the near plane": (0.05, 1e-3, 50.0),
    "focus on the far wall": (0.1, 9.0, 50.0),
    "focus behind everything": (0.1, 100.0, 50.0),
    "focus at infinity": (1.0, 1e6, 50.0),
    "1 degree": (0.05, 3.0, 1.0),
    "170 degrees": (1.0, 0.02, 170.0),
    "narrowest, widest, nearest": (1.0, 1e-3, FOV_Y_DEG[0]),
    "widest view": (1.0, 1e-3, FOV_Y_DEG[1]),
}


def lens(stage: Stage, aperture: float, focus: float, fov: float) -> tuple[Settings, Camera]:
    settings = put(put(stage.settings, "lens.aperture", aperture), "lens.focus_distance", focus)
    return settings, replace(stage.camera, fov_y=math.radians(fov))


def drawn(stage: Stage, view: str, settings: Settings, camera: Camera, count: int = 4) -> np.ndarray:
    """The linear picture, after checking that no target the frame wrote holds anything but finite numbers."""
    renderer = stage.draw(view, SIZE, frames=count, spp=count, settings=settings, camera=camera)
    for target in {name for call in renderer.plan.calls for name in call.writes}:
        assert np.isfinite(renderer.read(target)).all(), target
    picture = renderer.linear()
    assert (picture >= 0.0).all()
    return picture.astype(np.float64)


@pytest.fixture(scope="module")
def walls(ctx: moderngl.Context) -> Stage:
    """A near wall, a bright bar, a far wall up to half height, and the sky: flat colours, which filters must keep."""
    near, bar, far = (
        quad((0.1, -3.0, -1.2), (9.0, 0.0, 0.0), (0.0, 6.0, 0.0)),
        quad((-2.0, -0.6, -3.0), (4.0, 0.0, 0.0), (0.0, 0.5, 0.0), material=1),
        quad((-20.0, -20.0, -9.0), (40.0, 0.0, 0.0), (0.0, 20.0, 0.0), material=2),
    )
    colors = [Material((0.8, 0.2, 0.1, 1.0)), Material((0.9, 0.9, 0.2, 1.0)), Material((0.1, 0.3, 0.9, 1.0))]
    camera = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return stage_of(ctx, scene_of([near, bar, far], colors), camera, shading__mode="unlit")


@pytest.fixture(scope="module")
def leaf(ctx: moderngl.Context) -> Stage:
    """The edge of a leaf that all but touches the lens, down the middle of the picture, and a wall behind it."""
    near = quad((0.0, -0.02, -LEAF_M), (0.02, 0.0, 0.0), (0.0, 0.04, 0.0))
    wall = quad((-0.4, -0.2, -0.5), (0.8, 0.0, 0.0), (0.0, 0.4, 0.0), material=1)
    scene = scene_of([near, wall], [Material((0.8, 0.2, 0.1, 1.0)), Material((0.1, 0.3, 0.9, 1.0))])
    return stage_of(ctx, scene, Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)), shading__mode="unlit")


@pytest.mark.parametrize("name", LENSES)
def test_every_view_is_finite_through_every_lens(ctx: moderngl.Context, walls: Stage, name: str) -> None:
    settings, camera = lens(walls, *LENSES[name])
    brightest = max(0.9, *settings.shading.background)
    for view in VIEWS:
        assert drawn(walls, view, settings, camera).max() <= brightest * (1.0 + 4.0 * HALF), view
        assert ctx.error == "GL_NO_ERROR"


def assert_sharp(picture: np.ndarray, sharp: np.ndarray, roundings: int) -> None:
    """The same colour where the sharp picture is flat, and between its neighbours' elsewhere, however it was sampled.

    A pixel's samples all lie within its 3x3 neighbourhood, whose extremes their mean cannot leave.
    """
    window = (3, 3, 1)
    low, high = minimum_filter(sharp, window, mode="nearest"), maximum_filter(sharp, window, mode="nearest")
    assert (low == high).mean() > 0.5
    assert (picture >= low * (1.0 - roundings * HALF)).all()
    assert (picture <= high * (1.0 + roundings * HALF)).all()


@pytest.mark.parametrize("aperture", [0.0, 1e-42, 1e-6])
def test_a_lens_that_blurs_nothing_shows_the_sharp_picture(
    ctx: moderngl.Context, walls: Stage, aperture: float
) -> None:
    settings, camera = lens(walls, aperture, 3.0, 50.0)
    sharp = drawn(walls, "sharp", settings, camera)
    for view in ("post", "hybrid"):
        np.testing.assert_array_equal(drawn(walls, view, settings, camera), sharp)
    for view in ("traced", "reference"):
        assert_sharp(drawn(walls, view, settings, camera), sharp, roundings=1)


@pytest.mark.parametrize("view", BLURRED)
def test_everything_in_focus_is_the_sharp_picture(ctx: moderngl.Context, leaf: Stage, view: str) -> None:
    """Focused at the wall, with the leaf out of sight: whatever the aperture, nothing on screen is blurred.

    Three roundings to float16 on the longest way: lighting, the post-process or the hybrid, resolve.
    """
    settings, camera = lens(leaf, 0.02, 0.5, 0.5)
    camera = replace(camera, eye=(-0.2, 0.0, 0.0))
    sharp = drawn(leaf, "sharp", settings, camera)
    assert np.ptp(sharp, axis=(0, 1)).max() == 0.0
    np.testing.assert_allclose(drawn(leaf, view, settings, camera), sharp, rtol=3 * HALF)


@pytest.mark.parametrize("view", ["post", "hybrid"])
def test_the_least_blur_that_is_drawn_is_hardly_one(ctx: moderngl.Context, walls: Stage, view: str) -> None:
    """An aperture just above the one that plans no blur: the post-process runs, and moves nothing beyond a pixel."""
    camera = walls.camera
    scene = walls.renderer.scene
    facts = frame_facts(scene.facts, camera, Lens(aperture=0.05, focus_distance=9.0), SIZE, scene.near_plane)
    settings, camera = lens(walls, 0.05 * 0.72 / facts.near_coc_px, 9.0, math.degrees(camera.fov_y))
    sharp = drawn(walls, "sharp", settings, camera)
    assert "post" in {call.step.name for call in walls.draw(view, SIZE, settings=settings).plan.calls}
    picture = drawn(walls, view, settings, camera)
    assert_sharp(picture, sharp, roundings=3)


@pytest.mark.parametrize(("focus", "fov"), [(0.3, 2.4), (0.3, 1.0), (0.3, FOV_Y_DEG[0]), (1e6, 1.0)])
def test_a_blur_of_a_hundred_thousand_pixels_gets_its_rays(
    ctx: moderngl.Context, leaf: Stage, focus: float, fov: float
) -> None:
    """A near edge whose blur covers any picture many times over, up to beyond float16: rays everywhere, as traced."""
    settings, camera = lens(leaf, 1.0, focus, fov)
    hybrid = drawn(leaf, "hybrid", settings, camera, 8)
    assert leaf.renderer.read("coc").min() < -1e5
    assert (leaf.renderer.read("mask")[..., 1] == 1.0).all()
    traced = drawn(leaf, "traced", settings, camera, 16)
    reference = drawn(leaf, "reference", settings, camera, 16)
    assert hybrid.mean() == pytest.approx(traced.mean(), rel=0.02)
    assert reference.mean() == pytest.approx(traced.mean(), rel=0.2)
