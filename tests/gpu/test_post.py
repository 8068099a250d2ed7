"""The post-process as a whole, on pictures whose depth of field is known: points, flat fields, and silhouettes."""

from __future__ import annotations

import math

import moderngl
import numpy as np
import pytest

from app.optics import aberration_weight, lens_gauge
from app.settings import Settings, put

from .post_rig import UNLIT, PostRig

SIZE = (160, 96)
GROUND = 0.125  # exact in float16
FRAMES = 8
F16 = 2.0**-10  # relative spacing of float16; stores may round towards zero


def lens(**values: float) -> Settings:
    settings = UNLIT
    for name, value in values.items():
        settings = put(settings, f"lens.{name}", value)
    return settings


def point(
    ctx: moderngl.Context, coc: float, settings: Settings = UNLIT, frames: int = FRAMES
) -> tuple[np.ndarray, np.ndarray]:
    """(share of a point's light by pixel (h, w), offset of each pixel from it (h, w, 2) px) on a plane of one CoC."""
    width, height = SIZE
    lit = np.full((height, width, 3), GROUND)
    lit[48:50, 80:82] = 100.0
    with PostRig(ctx, SIZE, settings) as rig:
        picture = rig.mean(lit, np.full((height, width), coc), frames)[..., 0]
    y, x = np.mgrid[:height, :width] + 0.5
    return (picture - GROUND) / (4 * (100.0 - GROUND)), np.stack([x - 81.0, y - 49.0], -1)


@pytest.mark.parametrize("coc", [1.0, 3.0, 5.0, 9.0, 14.0, 20.0, 30.0, -3.0, -5.0, -9.0, -14.0, -20.0, -30.0])
def test_a_point_keeps_its_light_and_takes_the_size_of_its_circle(ctx: moderngl.Context, coc: float) -> None:
    share, offset = point(ctx, coc)
    assert share.sum() == pytest.approx(1.0, abs=0.02)
    second_moment = (share * (offset**2).sum(-1)).sum() / share.sum()
    ideal = coc * coc / 2 + 2 * 4 / 12  # of a disc, and of the 2x2 px that the point is
    assert math.sqrt(second_moment / ideal) == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize(
    "settings",
    [UNLIT, lens(blades=6, rotation=11.0), lens(anamorphic=1.8), lens(blades=5)],
    ids=["disc", "hexagon", "anamorphic", "pentagon"],
)
@pytest.mark.parametrize("coc", [24.0, -24.0])
def test_bokeh_has_the_shape_of_the_aperture_mirrored_in_front_of_focus(
    ctx: moderngl.Context, settings: Settings, coc: float
) -> None:
    share, offset = point(ctx, coc, settings)
    shape = settings.lens
    # Dividing by a negative CoC mirrors the aperture.
    gauge = lens_gauge(offset / coc, shape.blades, math.radians(shape.rotation), shape.anamorphic)
    assert share[gauge < 1.2].sum() > 0.97
    inside = share[gauge < 0.75]
    assert inside.std() / inside.mean() < 0.2
    if shape.blades == 5:  # the one shape that differs from its mirror image
        mirrored = lens_gauge(-offset / coc, 5, math.radians(shape.rotation), 1.0)
        assert share[gauge < 1.0].sum() > share[mirrored < 1.0].sum() + 0.02


@pytest.mark.parametrize("aberration", [-0.8, 0.8])
@pytest.mark.parametrize("coc", [24.0, -24.0])
def test_aberration_moves_light_between_rim_and_centre(ctx: moderngl.Context, aberration: float, coc: float) -> None:
    share, offset = point(ctx, coc, lens(spherical_aberration=aberration))
    area = (offset**2).sum(-1) / coc**2
    for low, high in ((0.0, 0.3), (0.3, 0.7)):
        ring = (area >= low) & (area < high)
        expected = aberration_weight((low + high) / 2, aberration) * (high - low)
        assert share[ring].sum() == pytest.approx(expected, abs=0.04)


@pytest.mark.parametrize("coc", [-60.0, -40.0, -17.3, -4.0, -3.0, -1.0, 0.0, 0.5, 1.0, 2.5, 3.9, 6.0, 18.0, 41.0])
def test_a_flat_field_stays_flat(ctx: moderngl.Context, coc: float) -> None:
    lit = np.full((96, 160, 3), (0.75, 0.3, 1e3))
    with PostRig(ctx, SIZE) as rig:
        picture = rig.run(lit, np.full((96, 160), coc))[..., :3]
    # Up to five roundings to float16 (downsample, prefilter, gather, median, composite).
    assert np.abs(picture / lit - 1.0).max() < 5 * F16


@pytest.mark.parametrize("slope", [0.05, 0.2])
def test_a_slanted_surface_covers_itself(ctx: moderngl.Context, slope: float) -> None:
    coc = np.broadcast_to(-8.0 - slope * np.arange(160), (96, 160))
    with PostRig(ctx, SIZE) as rig:
        picture = rig.run(np.full((96, 160, 3), 0.75), coc)[..., 0]
        coverage = rig.read("near_blur")[..., 3]
    assert np.abs(picture / 0.75 - 1.0).max() < 5 * F16
    assert coverage.min() > 0.93  # the splats of a slope overlap unevenly: an error of the order of its square


def test_focus_is_copied(ctx: moderngl.Context) -> None:
    lit = np.random.default_rng(1).random((96, 160, 3)).astype(np.float16)
    with PostRig(ctx, SIZE) as rig:
        assert (rig.run(lit, np.full((96, 160), 0.4))[..., :3] == lit).all()


def half_planes(left: float, right: float, coc_left: float, coc_right: float) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (96, 160, 3) and CoC of two surfaces that meet at x = 80 px."""
    is_left = np.broadcast_to(np.arange(160) < 80, (96, 160))
    return np.repeat(np.where(is_left, left, right)[..., None], 3, -1), np.where(is_left, coc_left, coc_right)


def edge_of_disc(x: np.ndarray, radius: float) -> np.ndarray:
    """Share of the lens that a half plane covers, x px right of its edge, for a CoC of `radius` px."""
    t = np.clip(x / radius, -1.0, 1.0)
    return 0.5 - (t * np.sqrt(1.0 - t * t) + np.arcsin(t)) / np.pi


@pytest.mark.parametrize("radius", [6.0, 12.0, 24.0])
@pytest.mark.parametrize("behind", [0.0, 10.0])
def test_a_near_surface_fades_over_what_is_behind_it(ctx: moderngl.Context, radius: float, behind: float) -> None:
    lit, coc = half_planes(1.0, 0.0, -radius, behind)
    with PostRig(ctx, SIZE) as rig:
        frames = [rig.run(lit, coc, i)[..., 0] for i in range(FRAMES)]
    profile = np.mean(frames, axis=0)[32:64].mean(0)
    assert (np.diff(profile) < 0.01).all()  # no dark or bright fringe
    assert profile.max() < 1.0 + 5 * F16
    assert profile.min() >= 0.0
    x = np.arange(160) + 0.5 - 80.0
    assert np.abs(profile - edge_of_disc(x, radius)).max() < 0.06
    assert np.abs(profile[x < -radius - 4] - 1.0).max() < 5 * F16
    assert profile[x > radius + 4].max() < 1e-3  # the prefilter's bilinear taps may touch both


@pytest.mark.parametrize("coc", [5.0, 12.0, 24.0])
def test_focus_and_far_background_do_not_leak_into_each_other(ctx: moderngl.Context, coc: float) -> None:
    for bright_left in (1.0, 0.0):
        lit, circles = half_planes(bright_left, 1.0 - bright_left, 0.0, coc)
        with PostRig(ctx, SIZE) as rig:
            picture = rig.run(lit, circles)[..., 0]
        assert np.abs(picture[:, :80] - bright_left).max() < 2 * F16
        assert np.abs(picture[:, 80:] - (1.0 - bright_left)).max() < 1e-2


def test_a_far_silhouette_has_its_own_blur_not_the_background_s(ctx: moderngl.Context) -> None:
    lit, circles = half_planes(1.0, 0.0, 6.0, 24.0)
    with PostRig(ctx, SIZE) as rig:
        profile = rig.mean(lit, circles, FRAMES)[32:64, :, 0].mean(0)
    x = np.arange(160) + 0.5 - 80.0
    assert (
        np.abs(profile - edge_of_disc(x, 6.0)).max() < 0.12
    )  # the background's kernel has its rings 5 px apart: that coarse
    assert profile[x > 10].max() < 1e-3


def test_a_thin_near_thing_is_see_through(ctx: moderngl.Context) -> None:
    lit, coc = np.zeros((96, 160, 3)), np.full((96, 160), 0.0)
    lit[..., 1] = 1.0
    lit[:, 78:82], coc[:, 78:82] = (1.0, 0.0, 0.0), -20.0
    with PostRig(ctx, SIZE) as rig:
        picture = rig.mean(lit, coc, FRAMES)[32:64].mean(0)
    # A strip of 4 px in a disc of radius 20 covers at most 4 * 40 / (pi 20^2) of it.
    assert picture[80, 0] == pytest.approx(4 * 40 / (math.pi * 400), abs=0.03)
    assert picture[80, 1] == pytest.approx(1 - picture[80, 0], abs=0.01)
    assert picture[:, 0].sum() == pytest.approx(4.0, rel=0.03)


def test_odd_input_stays_finite_and_local(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(3)
    lit, coc = np.full((96, 160, 4), 0.5), rng.uniform(-30, 30, (96, 160))
    for value in (np.nan, np.inf, -np.inf, -5.0):
        lit[rng.integers(0, 96, 5), rng.integers(0, 160, 5), rng.integers(0, 3, 5)] = value
        coc[rng.integers(0, 96, 5), rng.integers(0, 160, 5)] = value
    for settings in (UNLIT, Settings()):
        with PostRig(ctx, SIZE, settings) as rig:
            rig.run(lit, coc)
            for target in ("half_color", "prefiltered", "near_gather", "far_gather", "near_blur", "far_blur", "post"):
                assert np.isfinite(rig.read(target)).all(), target
            assert (rig.read("post") >= 0.0).all()


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (17, 33), (161, 91)])
def test_any_size(ctx: moderngl.Context, size: tuple[int, int]) -> None:
    lit, coc = np.full((size[1], size[0], 3), 0.5), np.linspace(-20, 20, size[0] * size[1]).reshape(size[::-1])
    with PostRig(ctx, size) as rig:
        assert np.abs(rig.run(lit, coc)[..., :3] / 0.5 - 1.0).max() < 5 * F16


@pytest.mark.parametrize(("name", "value"), [("rings", 2), ("rings", 8), ("slight_focus", False), ("median", False)])
def test_settings_compile_and_keep_a_flat_field(ctx: moderngl.Context, name: str, value: object) -> None:
    coc = np.broadcast_to(np.linspace(-30, 30, 160), (96, 160))
    with PostRig(ctx, SIZE, put(UNLIT, f"post.{name}", value)) as rig:
        assert np.abs(rig.run(np.full((96, 160, 3), 0.5), coc)[..., :3] / 0.5 - 1.0).max() < 5 * F16


def test_specular_luminance_follows_the_near_layer(ctx: moderngl.Context) -> None:
    lit, coc = half_planes(1.0, 0.5, -12.0, 0.0)
    with PostRig(ctx, SIZE, Settings()) as rig:
        post = rig.mean(np.concatenate([lit, np.where(coc < 0, 8.0, 2.0)[..., None]], -1), coc, FRAMES)
    profile = post[32:64].mean(0)
    x = np.arange(160) + 0.5 - 80.0
    assert np.abs(profile[:, 3] / 8.0 - edge_of_disc(x, 12.0)).max() < 0.06
    assert profile[x > 16, 3].max() == 0.0
