"""A small light out of focus shows the lens: every view must give its energy, its place, its size and its shape."""

from __future__ import annotations

import numpy as np
import pytest

from . import bokeh
from .bokeh import DEPTHS, SIZE, Moments

#: Lens settings, and what bokeh.expected needs to know of them.
LENSES = {
    "disc": ({}, {}),
    "hexagon": ({"lens__blades": 6}, {"blades": 6}),
    "turned hexagon": ({"lens__blades": 6, "lens__rotation": 30.0}, {"blades": 6}),
    "anamorphic": ({"lens__anamorphic": 2.0}, {"anamorphic": 2.0}),
    "bright rim": ({"lens__spherical_aberration": 0.7}, {"aberration": 0.7}),
    "bright centre": ({"lens__spherical_aberration": -0.7}, {"aberration": -0.7}),
}
TRUTHS = {"traced": {"spp": 256}, "reference": {"spp": 128}}
FILTERS = {"post": {"frames": 64}, "hybrid": {"frames": 64}}  # noise and sub-pixel position average out over the frames

#: (energy, relative; centroid, px; standard deviation along each axis, px)
# four standard errors: 256 samples on 36 px hit the light 9000 times, and each hit lies some 6 px from the centre
TRUE = (0.03, 0.2, 0.12)
FILTERED = (0.05, 0.25, 0.4)  # half-resolution texels are 2 px wide: a quarter of one in place, a fifth in size


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("side", DEPTHS)
def test_bokeh_has_the_lens_s_energy_place_size_and_shape(ctx, side: str, lens: str) -> None:
    settings, known = LENSES[lens]
    stage = bokeh.stage(ctx, DEPTHS[side], **settings)
    expected = bokeh.expected(DEPTHS[side], **known)
    pictures = {view: stage.linear(view, SIZE, **options) for view, options in {**TRUTHS, **FILTERS}.items()}
    for view, picture in pictures.items():
        assert_moments(view, bokeh.moments(picture), expected, TRUE if view in TRUTHS else FILTERED)
        assert_same_outline(view, picture, pictures["traced"])
        if "hexagon" in lens:
            assert_corner_lies(view, picture, to_the_right=lens == "hexagon")


def assert_moments(view: str, found: Moments, expected: Moments, tolerance: tuple[float, float, float]) -> None:
    energy, place, size = tolerance
    assert abs(found.energy / expected.energy - 1) <= energy, (
        f"{view} has {found.energy / expected.energy:.3f} of the light"
    )
    assert np.abs(found.centroid - expected.centroid).max() <= place, (
        f"{view} is off by {found.centroid - expected.centroid} px"
    )
    spread = np.sqrt(found.variance) - np.sqrt(expected.variance)
    assert np.abs(spread).max() <= size, f"{view} is too wide by {spread} px"


def assert_same_outline(view: str, picture: np.ndarray, truth: np.ndarray) -> None:
    """The bright pixels are the same but for the rim, some 80 of 400 to 600 px, of which half a pixel decides."""
    seen, wanted = bokeh.covered(picture), bokeh.covered(truth)
    overlap = (seen & wanted).sum() / (seen | wanted).sum()
    assert overlap >= 0.9, f"{view} covers {overlap:.2f} of the same pixels"


def assert_corner_lies(view: str, picture: np.ndarray, to_the_right: bool) -> None:
    corner = bokeh.sixfold(picture)
    assert (corner.real > 0) == to_the_right, f"{view} is turned: {corner:.3f}"
    assert abs(corner.imag) < abs(corner.real), f"{view} is turned or no hexagon: {corner:.3f}"
