"""A small light out of focus shows the lens: every view must give its energy, its place, its size and its shape."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from . import bokeh
from .bokeh import CORNER_PX, DEPTHS, SIZE, Light, Moments

#: Lens settings, and what bokeh.expected needs to know of them.
LENSES = {
    "disc": ({}, {}),
    "hexagon": ({"lens__blades": 6}, {"blades": 6}),
    "turned hexagon": ({"lens__blades": 6, "lens__rotation": 30.0}, {"blades": 6}),
    "anamorphic": ({"lens__anamorphic": 2.0}, {"anamorphic": 2.0}),
    "bright rim": ({"lens__spherical_aberration": 0.7}, {"aberration": 0.7}),
    "bright centre": ({"lens__spherical_aberration": -0.7}, {"aberration": -0.7}),
}
CAT_EYE = 0.8
TRUTHS = {"traced": {"spp": 256}, "reference": {"spp": 256}}
# Sub-pixel position averages out over the frames, and so does noise: of 256 x 4 rays to 0.5 % of the energy. Behind
# focus nothing is hidden, so there the hybrid sends none.
FRAMES = {("post", "near"): 64, ("post", "far"): 64, ("hybrid", "near"): 256, ("hybrid", "far"): 64}
EACH_SIDE = pytest.mark.parametrize("side", DEPTHS)

ENERGY = AREA = 0.02
PLACE_PX = 0.25  # an eighth of a half-resolution texel
# The hybrid traces the blur of what is near at half resolution: the mean of 2x2 px instead of one, and its bilinear
# upsampling, add a variance of 1/4 and 2/3 px^2 along each axis, 2.3 % of the area at a radius of 12 px.
HALF_RES_RAYS_PX2 = 1 / 4 + 2 / 3


@pytest.mark.parametrize("lens", LENSES)
@EACH_SIDE
def test_bokeh_has_the_lens_s_energy_place_size_and_shape(ctx: moderngl.Context, side: str, lens: str) -> None:
    settings, known = LENSES[lens]
    light = Light(side)
    expected = bokeh.expected(light, **known)
    pictures = assert_all_views(ctx, light, settings, expected)
    if "hexagon" in lens:
        for view, picture in pictures.items():
            assert_corner_lies(view, picture, to_the_right=lens == "hexagon")


@pytest.mark.parametrize("blades", [0, 6])
@EACH_SIDE
def test_the_barrel_cuts_it_alike(ctx: moderngl.Context, side: str, blades: int) -> None:
    light = Light(side, centre_px=CORNER_PX)
    expected = bokeh.expected_cut(light, CAT_EYE, blades)
    assert_all_views(ctx, light, {"lens__cat_eye": CAT_EYE, "lens__blades": blades}, expected)
    # Behind focus the side away from the picture's centre is cut, in front of focus the other.
    outwards = (expected.centroid - light.centre_px) @ (np.array(light.centre_px) - np.array(SIZE) / 2)
    assert (outwards < 0) == (side == "far")


@pytest.mark.parametrize("lens", ["disc", "hexagon", "bright rim", "bright centre"])
@pytest.mark.parametrize("radius", [6.0, 25.0])
@EACH_SIDE
def test_the_post_process_keeps_energy_and_area_at_every_size(
    ctx: moderngl.Context, side: str, radius: float, lens: str
) -> None:
    settings, known = LENSES[lens]
    light = Light(side, radius)
    picture = bokeh.stage(ctx, light, **settings).linear("post", SIZE, frames=64)
    assert_moments("post", bokeh.moments(picture), bokeh.expected(light, **known))


def assert_all_views(
    ctx: moderngl.Context, light: Light, settings: dict[str, object], expected: Moments
) -> dict[str, np.ndarray]:
    """Every view's picture, after its moments and its outline were compared."""
    stage = bokeh.stage(ctx, light, **settings)
    frames = {view: {"frames": count} for (view, side), count in FRAMES.items() if side == light.side}
    pictures = {view: stage.linear(view, SIZE, **options) for view, options in {**TRUTHS, **frames}.items()}
    for view, picture in pictures.items():
        softer = HALF_RES_RAYS_PX2 if view == "hybrid" and light.side == "near" else 0.0
        assert_moments(view, bokeh.moments(picture), softened(expected, softer))
        assert_same_outline(view, picture, pictures["traced"])
    return pictures


def softened(moments: Moments, variance: float) -> Moments:
    return replace(moments, covariance=moments.covariance + variance * np.eye(2))


def assert_moments(view: str, found: Moments, expected: Moments) -> None:
    assert abs(found.energy / expected.energy - 1) <= ENERGY, (
        f"{view} has {found.energy / expected.energy:.3f} of the light"
    )
    assert np.abs(found.centroid - expected.centroid).max() <= PLACE_PX, (
        f"{view} is off by {found.centroid - expected.centroid} px"
    )
    assert abs(found.area / expected.area - 1) <= AREA, f"{view} has {found.area / expected.area:.3f} of the area"


def assert_same_outline(view: str, picture: np.ndarray, truth: np.ndarray) -> None:
    """The bright pixels are the same but for the rim, some 80 of 400 to 600 px, of which half a pixel decides."""
    seen, wanted = bokeh.covered(picture), bokeh.covered(truth)
    overlap = (seen & wanted).sum() / (seen | wanted).sum()
    assert overlap >= 0.9, f"{view} covers {overlap:.2f} of the same pixels"


def assert_corner_lies(view: str, picture: np.ndarray, to_the_right: bool) -> None:
    corner = bokeh.sixfold(picture)
    assert (corner.real > 0) == to_the_right, f"{view} is turned: {corner:.3f}"
    assert abs(corner.imag) < abs(corner.real), f"{view} is turned or no hexagon: {corner:.3f}"
