"""The thin lens: three independent derivations give one circle of confusion, and the aperture is sampled by area."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import stats

from app.optics import (
    IN_FOCUS_COC_PX,
    SKY_DEPTH,
    aberrated_area,
    aberration_weight,
    barrel_reach,
    barrel_shift,
    coc_px,
    coc_scale_px,
    concentric_disc,
    lens_area,
    lens_gauge,
    lens_point,
    lens_spread,
    passes_barrel,
)
from app.sampling import sobol4

APERTURES = [(0, 0.0, 1.0), (3, 0.0, 1.0), (4, 0.7, 1.0), (5, -2.0, 1.6), (6, 3.0, 0.5), (9, 0.3, 1.0), (16, 0.0, 2.0)]
EACH_APERTURE = pytest.mark.parametrize(("blades", "rotation", "anamorphic"), APERTURES)
LIKELY = 1e-4  # tests of randomness fail by chance this rarely; their seeds are fixed, so in practice never

depths = st.floats(1e-3, 1e6)
scales = st.just(0.0) | st.floats(1e-12, 1e6)  # px m; a pinhole, or a lens whose products stay normal numbers
fovs = st.floats(math.radians(1), math.radians(170))
heights = st.integers(1, 8192)
aberrations = st.floats(-1.0, 1.0)


def uniform(count: int, seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).random((count, 2))


# -- the circle of confusion -------------------------------------------------------------------------------------------


@given(z=depths, d=depths, share=st.floats(1e-4, 0.9), aperture=st.floats(1e-4, 1.0), fov=fovs, height=heights)
def test_coc_is_the_textbook_formula(
    z: float, d: float, share: float, aperture: float, fov: float, height: int
) -> None:
    """c = A f |z - d| / (z (d - f)) on a sensor 2 d f / (d - f) tan(fov/2) high, whatever the focal length f < d."""
    f = share * d
    diameter_m = aperture * f * (z - d) / (z * (d - f))
    sensor_m = 2.0 * d * f / (d - f) * math.tan(fov / 2.0)
    expected = 0.5 * diameter_m / sensor_m * height
    scale = coc_scale_px(aperture, height, fov)
    tolerance = 1e-13 * scale * (1.0 / d + 1.0 / z) + 1e-13 * abs(expected)  # a difference of two rounded reciprocals
    assert abs(float(coc_px(z, scale, 1.0 / d)) - expected) <= tolerance


@given(
    z=st.floats(0.05, 1e4), d=st.floats(0.05, 1e4), x=st.floats(-3, 3), ux=st.floats(-1, 1), aperture=st.floats(0, 1)
)
def test_coc_is_what_a_lens_ray_does(z: float, d: float, x: float, ux: float, aperture: float) -> None:
    """The ray from lens point u through a point at depth z meets the focal plane u coc pixels from the pinhole's
    pixel.
    """
    fov, height = math.radians(40), 720
    point, lens = np.array([x * z, z]), np.array([ux * aperture / 2, 0.0])
    at_focus = lens + (point - lens) * (d / z)
    metres_per_pixel = 2.0 * d * math.tan(fov / 2.0) / height
    moved_px = (at_focus[0] - x * d) / metres_per_pixel
    expected = ux * float(coc_px(z, coc_scale_px(aperture, height, fov), 1.0 / d))
    cancelled = (abs(x) * d + (abs(lens[0]) + abs(point[0])) * (1.0 + d / z)) / metres_per_pixel
    assert abs(moved_px - expected) <= 1e-14 * cancelled + 1e-12


@given(d=depths, scale=scales, a=depths, b=depths)
def test_sign_order_and_limits(d: float, scale: float, a: float, b: float) -> None:
    near, far = sorted((a, b))
    assert float(coc_px(d, scale, 1.0 / d)) == 0.0
    assert float(coc_px(near, scale, 1.0 / d)) <= float(coc_px(far, scale, 1.0 / d))
    assert float(coc_px(math.inf, scale, 1.0 / d)) == scale * (1.0 / d)
    sky = float(coc_px(SKY_DEPTH, scale, 1.0 / d))
    assert 0.0 <= scale / d - sky <= 1e-9 * scale + 1e-15 * scale / d
    assert np.isfinite(sky)


@given(z=depths, d=depths, fov=fovs)
def test_a_pinhole_blurs_nothing(z: float, d: float, fov: float) -> None:
    assert float(coc_px(z, coc_scale_px(0.0, 1080, fov), 1.0 / d)) == 0.0


@given(height=st.integers(1, 4000), fov=fovs, z=depths, d=depths)
def test_coc_is_a_fraction_of_the_image_height(height: int, fov: float, z: float, d: float) -> None:
    one, two = (float(coc_px(z, coc_scale_px(0.1, h, fov), 1.0 / d)) for h in (height, 2 * height))
    assert two == 2.0 * one


def test_the_focus_zone_is_the_posters() -> None:
    assert pytest.approx(2.0) == (2.0 * IN_FOCUS_COC_PX) ** 2


# -- the aperture ------------------------------------------------------------------------------------------------------


@EACH_APERTURE
def test_points_lie_inside_and_fill_it_by_area(blades: int, rotation: float, anamorphic: float) -> None:
    """Uniform by area: the gauge squared is uniform, and so is where on the rim a point lies, independently of it."""
    points = lens_point(uniform(20_000), blades, rotation, anamorphic)
    gauge = lens_gauge(points, blades, rotation, anamorphic)
    assert gauge.max() <= 1.0 + 1e-12
    assert stats.kstest(gauge**2, "uniform").pvalue > LIKELY
    around = perimeter(points, blades, rotation, anamorphic)
    assert stats.kstest(around, "uniform").pvalue > LIKELY
    table = np.histogram2d(gauge**2, around, bins=8)[0]
    assert stats.chi2_contingency(table).pvalue > LIKELY


def perimeter(points: np.ndarray, blades: int, rotation: float, anamorphic: float) -> np.ndarray:
    """Area swept from angle 0 to each point's direction, as a fraction of the whole: uniform for points uniform by
    area.
    """
    angle = (np.arctan2(points[:, 1], points[:, 0] * anamorphic) - rotation) / (2.0 * math.pi) % 1.0
    if blades < 3:
        return angle
    side = np.floor(angle * blades)
    within = (angle * blades - side - 0.5) * 2.0 * math.pi / blades
    return (side + 0.5 + 0.5 * np.tan(within) / math.tan(math.pi / blades)) / blades


@EACH_APERTURE
def test_cells_of_the_plane_get_points_by_their_area(blades: int, rotation: float, anamorphic: float) -> None:
    """Against rejection sampling through the gauge: two samples of one distribution, whatever the shape."""
    points = lens_point(uniform(20_000, 5), blades, rotation, anamorphic)
    reach = np.array([max(1.0, 1.0 / anamorphic), 1.0])
    box = (2.0 * uniform(100_000, 6) - 1.0) * reach
    accepted = box[lens_gauge(box, blades, rotation, anamorphic) <= 1.0]
    bins = [np.linspace(-r, r, 7) for r in reach]
    counts = np.stack([np.histogram2d(*p.T, bins=bins)[0].ravel() for p in (points, accepted)])
    assert stats.chi2_contingency(counts[:, counts.sum(0) > 20]).pvalue > LIKELY


@EACH_APERTURE
def test_area_by_monte_carlo(blades: int, rotation: float, anamorphic: float) -> None:
    reach = np.array([max(1.0, 1.0 / anamorphic), 1.0])
    inside = lens_gauge((2.0 * uniform(200_000, 8) - 1.0) * reach, blades, rotation, anamorphic) <= 1.0
    box = 4.0 * reach.prod()
    share = lens_area(blades, anamorphic) / box
    assert abs(inside.mean() - share) < 4.0 * math.sqrt(share * (1.0 - share) / inside.size)


@EACH_APERTURE
def test_the_rim_has_gauge_one_and_the_gauge_scales(blades: int, rotation: float, anamorphic: float) -> None:
    u = uniform(500)
    if blades < 3:
        rim = concentric_disc(np.stack([u[:, 0], np.ones(500)], -1)) / [
            anamorphic,
            1.0,
        ]  # the square's edge is the circle
    else:
        rim = lens_point(np.stack([u[:, 0], np.ones(500)], -1), blades, rotation, anamorphic)
    np.testing.assert_allclose(lens_gauge(rim, blades, rotation, anamorphic), 1.0, rtol=1e-13)
    for factor in (1e-6, 0.3, 7.0):
        np.testing.assert_allclose(lens_gauge(factor * rim, blades, rotation, anamorphic), factor, rtol=1e-13)
    assert lens_gauge([[0.0, 0.0]], blades, rotation, anamorphic)[0] == 0.0


@pytest.mark.parametrize("blades", [3, 4, 5, 6, 8, 16])
def test_a_polygon_has_its_corners_on_the_circle(blades: int) -> None:
    corners = 2.0 * math.pi * np.arange(blades) / blades + 0.4
    on_circle = np.stack([np.cos(corners), np.sin(corners)], -1)
    np.testing.assert_allclose(lens_gauge(on_circle, blades, 0.4), 1.0, rtol=1e-12)
    middles = corners + math.pi / blades
    on_edges = math.cos(math.pi / blades) * np.stack([np.cos(middles), np.sin(middles)], -1)
    np.testing.assert_allclose(lens_gauge(on_edges, blades, 0.4), 1.0, rtol=1e-12)


@given(blades=st.integers(3, 16), rotation=st.floats(-4, 4), turns=st.integers(-3, 3))
def test_turning_a_polygon_by_one_blade_changes_nothing(blades: int, rotation: float, turns: int) -> None:
    offsets = 2.0 * uniform(32) - 1.0
    turned = lens_gauge(offsets, blades, rotation + turns * 2.0 * math.pi / blades)
    np.testing.assert_allclose(turned, lens_gauge(offsets, blades, rotation), rtol=1e-12)


@given(
    u=st.floats(0, 1), v=st.floats(0, 1), blades=st.integers(0, 16), rotation=st.floats(-4, 4),
    anamorphic=st.floats(0.25, 4), s=aberrations,
)  # fmt: skip
def test_no_corner_of_the_square_leaves_the_aperture(
    u: float, v: float, blades: int, rotation: float, anamorphic: float, s: float
) -> None:
    point = lens_point([[u, v]], blades, rotation, anamorphic, s)
    assert np.isfinite(point).all()
    assert lens_gauge(point, blades, rotation, anamorphic)[0] <= 1.0 + 1e-12


def test_the_disc_map_keeps_neighbours_together() -> None:
    """Continuous and area-preserving: a step in the square moves a point at most by a constant factor (Shirley and Chiu
    1997).
    """
    base = uniform(5000)
    for axis in (0, 1):
        step = np.zeros(2)
        step[axis] = 1e-7
        moved = np.linalg.norm(concentric_disc(base + step) - concentric_disc(base), axis=-1)
        assert moved.max() < 1e-7 * math.pi  # the Jacobian's largest singular value is below pi


# -- spherical aberration ----------------------------------------------------------------------------------------------


@given(u=st.floats(0, 1), s=aberrations)
def test_aberrated_area_inverts_its_cumulative(u: float, s: float) -> None:
    t = float(aberrated_area(u, s))
    assert 0.0 <= t <= 1.0 + 1e-15
    assert (1.0 - s) * t + s * t * t == pytest.approx(u, rel=1e-13, abs=1e-15)


@given(u=st.floats(0, 1), s=st.floats(-1e-12, 1e-12))
def test_no_aberration_is_the_limit_of_little(u: float, s: float) -> None:
    assert float(aberrated_area(u, s)) == pytest.approx(u, abs=1e-12)
    assert float(aberrated_area(u, 0.0)) == u


@given(s=aberrations)
def test_the_weight_has_mean_one_and_is_never_negative(s: float) -> None:
    t = (np.arange(1000) + 0.5) / 1000  # the midpoint rule is exact for a linear function
    assert aberration_weight(t, s).mean() == pytest.approx(1.0, abs=1e-13)
    assert aberration_weight(t, s).min() >= 0.0


@pytest.mark.parametrize("s", [-1.0, -0.6, 0.0, 0.4, 1.0])
@pytest.mark.parametrize("blades", [0, 5])
def test_rays_and_ring_weights_show_one_bokeh(s: float, blades: int) -> None:
    """Points drawn for rays have the density by which the gather weights its rings."""
    points = lens_point(sobol4(np.arange(1 << 14), 9)[:, :2], blades, 0.3, 1.5, s)
    t = lens_gauge(points, blades, 0.3, 1.5) ** 2
    edges = np.linspace(0.0, 1.0, 33)
    density = np.histogram(t, edges)[0] / len(t) * 32
    np.testing.assert_allclose(density, aberration_weight((edges[1:] + edges[:-1]) / 2, s), atol=0.03)


@given(s=aberrations, a=st.floats(0, 1), b=st.floats(0, 1))
def test_aberration_keeps_the_order_of_radii(s: float, a: float, b: float) -> None:
    assume(a < b)
    assert float(aberrated_area(a, s)) <= float(aberrated_area(b, s))


@pytest.mark.parametrize("s", [-0.7, 0.0, 1.0])
@EACH_APERTURE
def test_spread_is_the_mean_square_of_the_points(blades: int, rotation: float, anamorphic: float, s: float) -> None:
    points = lens_point(sobol4(np.arange(1 << 14), 4)[:, :2], blades, rotation, anamorphic, s)
    # A turned polygon under a squeeze has the mean over its turns: regular polygons spread alike in all directions.
    assert np.mean(np.sum(points**2, -1)) == pytest.approx(lens_spread(blades, anamorphic, s), rel=2e-3)


# -- the barrel --------------------------------------------------------------------------------------------------------

WIDE = (640, 360)


def test_the_barrel_shifts_away_from_what_is_looked_at() -> None:
    assert (barrel_shift([[320.0, 180.0]], WIDE, 0.8) == 0.0).all()
    corner, right = barrel_shift([[640.0, 360.0], [640.0, 180.0]], WIDE, 0.8)
    assert np.linalg.norm(corner) == pytest.approx(0.8, rel=1e-14)
    assert (corner < 0.0).all()
    assert right[0] < 0.0
    assert right[1] == 0.0


@given(x=st.floats(-2, 2), y=st.floats(-2, 2), slope_x=st.floats(-1, 1), slope_y=st.floats(-1, 1))
def test_the_barrel_is_a_second_rim_in_front_of_the_aperture(
    x: float, y: float, slope_x: float, slope_y: float
) -> None:
    """A ray to u from a direction of slope m [m per metre of depth] was at u + m t on the rim's plane, t in front."""
    u, slope = np.array([x, y]), np.array([slope_x, slope_y])
    image_px = np.array(WIDE) / 2 * (1.0 + slope / np.array([1.0, WIDE[1] / WIDE[0]]))  # 45 degrees at the side
    cat_eye = 0.9
    t = cat_eye * WIDE[0] / math.hypot(*WIDE)  # of the lens' half diameter
    distance = float(np.linalg.norm(u + t * slope))
    assume(abs(distance - 1.0) > 1e-12)
    assert bool(passes_barrel(u, barrel_shift(image_px, WIDE, cat_eye))) == (distance <= 1.0)


@pytest.mark.parametrize("shift", [0.0, 0.3, 1.0])
def test_what_passes_has_the_area_that_two_discs_share(shift: float) -> None:
    points = lens_point(sobol4(np.arange(1 << 15), 2)[:, :2])
    shared = (2.0 * math.acos(shift / 2.0) - shift / 2.0 * math.sqrt(4.0 - shift**2)) / math.pi
    assert passes_barrel(points, [0.6 * shift, -0.8 * shift]).mean() == pytest.approx(shared, abs=1e-3)


@given(x=st.floats(-2, 2), y=st.floats(-2, 2), length=st.floats(0, 1), angle=st.floats(0, 7))
def test_reach_leads_to_the_barrel_s_rim(x: float, y: float, length: float, angle: float) -> None:
    assume(math.hypot(x, y) > 1e-3)
    point, shift = np.array([x, y]), length * np.array([math.cos(angle), math.sin(angle)])
    reach = float(barrel_reach(point, shift))
    assert reach >= 0.0
    # |shift| = 1 leaves 1 - |shift|^2 a few roundings off, of which the root takes the root.
    assert np.linalg.norm(reach * point - shift) == pytest.approx(1.0, abs=1e-7)
    if abs(reach - 1.0) > 1e-6:
        assert bool(passes_barrel(point, shift)) == (reach > 1.0)
