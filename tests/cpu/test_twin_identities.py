"""What the float64 twins of glsl/lib must be whatever they are given: identities that need no second formula."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.gpu.octahedral import octahedral_decode, octahedral_encode
from app.optics import coc_px
from app.tone import srgb_decode, srgb_encode, tone_aces, tone_neutral
from tests.gpu import hybrid_twin, library_twin, post_twin, shading_twin

EPS = 2.0**-52
unit = st.floats(0.0, 1.0)
signed = st.floats(-1.0, 1.0)
lengths = st.floats(0.0, 1e9)
cocs = st.floats(-1e9, 1e9)
lights = st.floats(0.0, 6e4)
colors = st.tuples(lights, lights, lights)


@given(z=st.floats(1e-9, 1e9), further=st.floats(1.0, 1e6), k=lengths, inverse=st.floats(0.0, 1e3))
def test_blur_grows_with_depth_up_to_its_limit(z: float, further: float, k: float, inverse: float) -> None:
    near, far, sky = coc_px([z, z * further, np.inf], k, inverse)
    assert near <= far <= sky == k * inverse


@given(rims=st.lists(lengths, min_size=2, max_size=9).map(sorted), radius2=st.floats(0.0, 1e9), s=signed)
def test_adjoining_rings_share_out_what_they_hold_together(rims: list[float], radius2: float, s: float) -> None:
    inner, outer = np.array(rims[:-1]), np.array(rims[1:])
    parts = post_twin.ring_light(inner, outer, radius2, s)
    assert parts.sum() == pytest.approx(float(post_twin.ring_light(rims[0], rims[-1], radius2, s)), abs=16 * EPS)
    assert (parts >= -4 * EPS).all()
    even, squared = np.moveaxis(post_twin.ring_area(inner, outer, radius2), -1, 0)
    np.testing.assert_allclose((1.0 - s) * even + s * squared, parts, atol=16 * EPS)
    assert float(post_twin.enclosed_light(1.0, s)) == pytest.approx(1.0, abs=2 * EPS)


@given(fore=st.tuples(*[unit] * 3, st.floats(0.0, 3.0)), behind=st.tuples(*[unit] * 3, st.floats(0.0, 3.0)))
def test_two_layers_never_cover_more_than_the_lens(fore: tuple[float, ...], behind: tuple[float, ...]) -> None:
    both = post_twin.stacked(fore, behind)
    assert both[3] <= max(1.0, fore[3] / max(fore[3], 1.0)) + 4 * EPS
    assert (both >= 0.0).all()


@given(own=cocs, coc=cocs)
def test_the_nearer_of_two_draws_the_edge_between_them(own: float, coc: float) -> None:
    assert post_twin.silhouette_px(own, coc) == post_twin.silhouette_px(coc, own) == abs(min(own, coc))


@given(radius=st.floats(0.0, 5e3), wider=st.floats(0.0, 5e3))
def test_a_wider_blur_reaches_no_fewer_tiles_and_all_that_it_touches(radius: float, wider: float) -> None:
    reach = int(post_twin.tile_reach(radius))
    assert reach <= int(post_twin.tile_reach(radius + wider))
    assert reach * 16 >= radius or reach == 0


@given(st.tuples(cocs, cocs, cocs))
def test_a_slope_is_odd_and_no_steeper_than_any_difference(d: tuple[float, float, float]) -> None:
    slope = float(hybrid_twin.own_slope(d))
    assert slope == -float(hybrid_twin.own_slope([-x for x in d]))
    assert abs(slope) <= min(map(abs, d))


@given(coc=cocs, blend=st.floats(0.05, 8.0), focus=st.floats(0.1, 2.0))
def test_layers_share_and_never_overdraw(coc: float, blend: float, focus: float) -> None:
    near, raster = (float(f(coc, focus, blend)) for f in (hybrid_twin.near_share, hybrid_twin.raster_share))
    assert 0.0 <= near <= 1.0
    assert 0.0 <= raster <= 1.0 - near


@given(accumulated=unit, latest=unit, rays=st.integers(0, 1 << 20))
def test_a_trusted_ratio_is_trusted_again(accumulated: float, latest: float, rays: int) -> None:
    once = float(hybrid_twin.trusted_ratio(accumulated, latest, rays))
    assert 0.0 <= once <= 1.0
    assert float(hybrid_twin.trusted_ratio(once, latest, rays)) == once
    assert float(hybrid_twin.trusted_ratio(latest, latest, rays)) == pytest.approx(latest, abs=4 * EPS)


@given(noise=lengths, signal=lengths, spread=lengths)
def test_what_is_smoothed_is_what_noise_explains(noise: float, signal: float, spread: float) -> None:
    share = float(hybrid_twin.neighbour_share(noise, signal))
    assert 0.0 <= share <= 1.0
    assert share == 0.0 if noise == 0.0 else signal > 0.0 or share == 1.0
    assert 0.0 <= float(hybrid_twin.signal_variance(spread, noise)) <= spread


@given(before=unit, now=unit)
def test_change_of_light_has_no_direction_and_no_scale(before: float, now: float) -> None:
    change = float(hybrid_twin.light_change(before, now))
    assert change == float(hybrid_twin.light_change(now, before))
    assert 0.0 <= change <= 1.0
    if max(before, now) > 2 * hybrid_twin.DARK:
        assert change == pytest.approx(float(hybrid_twin.light_change(before / 2, now / 2)), rel=8 * EPS)


@given(point=colors, centre=colors, reach=colors)
def test_what_is_clipped_to_a_box_lies_in_it_and_stays(point: tuple, centre: tuple, reach: tuple) -> None:
    clipped = shading_twin.clip_to_box(point, centre, reach)
    room = np.maximum(reach, 1e-6) * (1.0 + 8 * EPS) + 8 * EPS * 6e4
    assert (np.abs(clipped - centre) <= room).all()
    if (np.abs(np.subtract(point, centre)) <= reach).all():
        np.testing.assert_allclose(clipped, point, atol=2 * EPS * 6e4)


@given(f=unit)
def test_resampling_weights_add_to_one_and_mirror(f: float) -> None:
    w0, w12, w3, offset = library_twin.catmull_rom_weights(f)
    assert w0 + w12 + w3 == pytest.approx(1.0, abs=8 * EPS)
    m0, m12, m3, m_offset = library_twin.catmull_rom_weights(1.0 - f)
    np.testing.assert_allclose([m0, m12, m3, m_offset], [w3, w12, w0, 1.0 - offset], atol=16 * EPS)
    assert 0.0 <= offset <= 1.0


@given(direction=st.tuples(signed, signed, signed).filter(lambda v: np.linalg.norm(v) > 1e-6))
def test_a_direction_survives_the_square(direction: tuple[float, float, float]) -> None:
    n = np.array([direction]) / np.linalg.norm(direction)
    p = octahedral_encode(n)
    assert (np.abs(p) <= 1.0).all()
    np.testing.assert_allclose(octahedral_decode(p), n, atol=8 * EPS)


@given(c=colors, brighter=st.floats(1.0, 1e6))
def test_brighter_light_is_never_shown_darker(c: tuple[float, float, float], brighter: float) -> None:
    for curve in (tone_aces, tone_neutral):
        low, high = curve(np.array([c])), curve(brighter * np.array([c]))
        assert low.max() <= high.max() + 8 * EPS
        assert high.max() <= 1.0 + 4 * EPS


@given(x=unit)
def test_display_values_read_back(x: float) -> None:
    assert float(srgb_decode(srgb_encode(x))) == pytest.approx(x, abs=1e-7)  # the standard's pieces meet at 8e-8


@given(c=st.tuples(*[st.floats(-6e4, 6e4)] * 3))
def test_luma_and_chroma_read_back(c: tuple[float, float, float]) -> None:
    there = shading_twin.ycocg_from_rgb(c)
    np.testing.assert_allclose(shading_twin.rgb_from_ycocg(there), c, atol=8 * EPS * 6e4)


@given(mean=st.floats(0.0, 1e6), value=st.floats(allow_nan=True, allow_infinity=True), count=st.integers(0, 1 << 24))
def test_a_sample_moves_a_mean_towards_itself(mean: float, value: float, count: int) -> None:
    new = library_twin.add_sample([mean] * 3 + [count], [0.0] * 3, [value] * 3)
    taken = value if abs(value) < library_twin.USABLE else 0.0
    assert new[3] == count + 1
    room = 4 * EPS * (abs(mean) + abs(taken))
    assert (min(mean, taken) - room <= new[:3]).all()
    assert (new[:3] <= max(mean, taken) + room).all()
