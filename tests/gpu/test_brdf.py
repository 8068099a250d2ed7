"""The surface model: against float64 twins, against numerical integrals, and against energy conservation."""

from __future__ import annotations

import numpy as np
import pytest

from app.gpu.shaders import load_glsl

from . import shading_twin as twin
from .harness import call_glsl

FILE = "lib/brdf.glsl"
ANGLES = np.array([0.02, 0.05, 0.1, 0.3, 0.5, 0.8, 1.0])
ROUGHNESS = np.array([0.1, 0.2, 0.35, 0.5, 0.75, 1.0])
FIT_ERROR = 0.045  # largest of all four polynomials, where the model turns fastest: smooth and grazing
TOTAL_ERROR = 0.032  # relative, of scale + offset, which is what energy depends on; 0.031 at n_v 0.02


def grid() -> tuple[np.ndarray, np.ndarray]:
    cosines, roughness = np.meshgrid(ANGLES, ROUGHNESS)
    return cosines.ravel(), roughness.ravel()


def test_distribution(ctx) -> None:
    angle = np.array([0.0, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0, 1.5])
    h = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1)
    for alpha in (0.01, 0.1, 1.0):
        got = call_glsl(ctx, FILE, "float ggx_distribution(vec3 n, vec3 h, float alpha)", [0.0, 0.0, 1.0], h, alpha)
        # Rounding of h moves the angle by 6e-8, and D changes fastest, by 1/alpha per radian, at its shoulder.
        np.testing.assert_allclose(got, twin.ggx_distribution([0.0, 0.0, 1.0], h, alpha), rtol=2e-5)


def test_distribution_projects_to_one() -> None:
    theta = (np.arange(200000) + 0.5) / 200000 * np.pi / 2
    h = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    for alpha in (0.01, 0.3, 1.0):
        d = twin.ggx_distribution([0.0, 0.0, 1.0], h, alpha)
        assert np.sum(d * np.cos(theta) * np.sin(theta)) * 2 * np.pi * (np.pi / 2 / 200000) == pytest.approx(
            1.0, abs=1e-3
        )


def test_visibility(ctx) -> None:
    n_l, n_v = (a.ravel() for a in np.meshgrid(ANGLES, ANGLES))
    for alpha in (0.01, 0.3, 1.0):
        got = call_glsl(ctx, FILE, "float smith_visibility(float n_l, float n_v, float alpha)", n_l, n_v, alpha)
        np.testing.assert_allclose(got, twin.smith_visibility(n_l, n_v, alpha), rtol=1e-5)


def test_visibility_stays_finite_where_nothing_arrives(ctx) -> None:
    got = call_glsl(
        ctx, FILE, "float smith_visibility(float n_l, float n_v, float alpha)", [0.0, 0.0, 1.0], [0.0, 1e-4, 0.0], 0.01
    )
    assert np.isfinite(got).all()


def test_fresnel(ctx) -> None:
    f0 = np.tile([0.04, 0.5, 1.0], (len(ANGLES), 1))
    got = call_glsl(ctx, FILE, "vec3 schlick_fresnel(vec3 f0, float v_h)", f0, ANGLES)
    np.testing.assert_allclose(got, twin.schlick_fresnel(f0, ANGLES), rtol=1e-6)


def test_fits_match_their_twins(ctx) -> None:
    n_v, roughness = grid()
    for name in ("specular_albedo", "specular_lobe"):
        got = call_glsl(ctx, FILE, f"vec2 {name}(float n_v, float roughness)", n_v, roughness)
        # Terms reach 30 and cancel: 16 of them, each rounded to 6e-8 of that.
        np.testing.assert_allclose(got, getattr(twin, name)(n_v, roughness), atol=16 * 30 * 6e-8)


def test_fits_match_the_integrals() -> None:
    for n_v, roughness in zip(*grid(), strict=True):
        scale, offset, mean = twin.specular_integrals(n_v, roughness)
        along = twin.specular_lobe(n_v, roughness)
        mirror = np.array([-np.sqrt(1 - n_v**2), 0, n_v])
        np.testing.assert_allclose(twin.specular_albedo(n_v, roughness), [scale, offset], atol=FIT_ERROR)
        np.testing.assert_allclose(along[0] * mirror + along[1] * np.array([0, 0, 1]), mean, atol=FIT_ERROR)


def test_white_surfaces_return_what_they_receive() -> None:
    """The white furnace for direct light: both parts integrated over all light directions."""
    for n_v, roughness in zip(*grid(), strict=True):
        scale, offset, _ = twin.specular_integrals(n_v, roughness)
        fitted = twin.specular_albedo(n_v, roughness)
        gain = twin.multiple_scattering([[twin.DIELECTRIC_F0], [1.0]], [fitted, fitted])[:, 0]
        base = 1 - min((twin.DIELECTRIC_F0 * fitted[0] + fitted[1]) * gain[0], 1)
        assert (twin.DIELECTRIC_F0 * scale + offset) * gain[0] + base == pytest.approx(1, abs=TOTAL_ERROR)
        assert (scale + offset) * gain[1] == pytest.approx(1, rel=TOTAL_ERROR)  # a white metal returns all
        assert scale + offset <= 1 + 1e-3


def test_multiple_scattering(ctx) -> None:
    f0 = np.array([[0.04, 0.5, 1.0]] * 4)
    albedo = np.array([[0.9, 0.1], [0.4, 0.05], [0.01, 0.0], [1.0, 1.0]])
    got = call_glsl(ctx, FILE, "vec3 multiple_scattering(vec3 f0, vec2 albedo)", f0, albedo)
    np.testing.assert_allclose(got, twin.multiple_scattering(f0, albedo), rtol=1e-6)


def test_sky(ctx) -> None:
    sky, ground, y = (0.5, 0.6, 0.7), (0.1, 0.2, 0.05), np.linspace(-1, 1, 9)
    got = call_glsl(ctx, FILE, "vec3 hemisphere_radiance(vec3 sky, vec3 ground, float y)", sky, ground, y)
    np.testing.assert_allclose(got, twin.hemisphere_radiance(sky, ground, y), rtol=1e-6)


def test_diffuse_sky_is_the_cosine_weighted_mean(ctx) -> None:
    sky, ground = (0.5, 0.6, 0.7), (0.1, 0.2, 0.05)
    u, v = ((a.ravel() + 0.5) / 400 for a in np.meshgrid(np.arange(400), np.arange(400)))
    local = np.stack([np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v), np.sqrt(1 - u)], -1)
    for tilt in (0.0, 0.7, np.pi / 2, 2.5, np.pi):
        height = local[:, 2] * np.cos(tilt) + local[:, 0] * np.sin(
            tilt
        )  # of cosine-distributed directions around the tilted normal
        got = call_glsl(
            ctx, FILE, "vec3 hemisphere_diffuse(vec3 sky, vec3 ground, float y)", sky, ground, [np.cos(tilt)]
        )
        np.testing.assert_allclose(got[0], twin.hemisphere_radiance(sky, ground, height).mean(0), rtol=1e-4)


def test_light_falloff(ctx) -> None:
    d = np.array([0.0, 1e-5, 0.1, 1.0, 4.999, 5.0, 7.0, 1e6])
    for inverse_range in (0.0, 0.2):
        got = call_glsl(ctx, FILE, "float distance_attenuation(float d, float r)", d, inverse_range)
        np.testing.assert_allclose(got, twin.distance_attenuation(d, inverse_range), rtol=1e-5, atol=1e-6)
    cosine = np.linspace(-1, 1, 21)
    got = call_glsl(ctx, FILE, "float spot_attenuation(float c, float s, float o)", cosine, 4.0, -2.0)
    np.testing.assert_allclose(got, twin.spot_attenuation(cosine, 4.0, -2.0), atol=1e-6)


def test_smallest_roughness_keeps_highlights_in_float16() -> None:
    """A mirror that faces a sun of 80 lux, far more than the default exposure can show, must not overflow."""
    text = load_glsl()[FILE]
    alpha = float(text.split("MIN_ROUGHNESS = ")[1].split(";")[0]) ** 2
    assert 80 * twin.ggx_distribution([0, 0, 1], [0, 0, 1], alpha) * twin.smith_visibility(1.0, 1.0, alpha) < 65504


def test_colour_functions(ctx) -> None:
    rgb = np.random.default_rng(2).random((50, 3)) * 10
    np.testing.assert_allclose(
        call_glsl(ctx, "lib/color.glsl", "float luminance(vec3 c)", rgb), twin.luminance(rgb), rtol=1e-5
    )
    coded = call_glsl(ctx, "lib/color.glsl", "vec3 ycocg_from_rgb(vec3 c)", rgb)
    np.testing.assert_allclose(coded, twin.ycocg_from_rgb(rgb), atol=1e-5)
    back = call_glsl(ctx, "lib/color.glsl", "vec3 rgb_from_ycocg(vec3 c)", coded)
    np.testing.assert_allclose(back, rgb, atol=1e-5)
    np.testing.assert_allclose(twin.rgb_from_ycocg(twin.ycocg_from_rgb(rgb)), rgb, atol=1e-12)


def test_unusable_colours_are_known(ctx) -> None:
    values = np.array([[0, 0, 0], [np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf], [6e4, -1, 1e-38]], np.float32)
    assert call_glsl(ctx, "lib/finite.glsl", "bool is_usable(vec3 c)", values).tolist() == [1, 0, 0, 0, 1]
