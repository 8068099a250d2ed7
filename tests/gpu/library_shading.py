"""Where the shading, colour and display functions of glsl/lib are compared with their twins, and how closely."""

from __future__ import annotations

import numpy as np

from app import tone
from app.gpu import octahedral
from app.measure import metrics
from app.panel import colormap

from . import library_twin as rest
from . import shading_twin as twin
from .edges import EPS, OPEN, Case, edges, exactly, integers, rowwise, ulps

UNIT = edges(0.0, 1.0)
SIGNED = edges(-1.0, 1.0)
LIGHT = edges(0.0, 1e30)  # what a running mean takes in
HALF_LIGHT = edges(0.0, 6e4)  # what radiance targets hold
ALPHA = edges(0.01, 1.0)  # roughness squared
N_V = edges(1e-4, 1.0)
ROUGHNESS = edges(0.1, 1.0)
FIT = 240.0  # sixteen terms of up to 30, each rounded by half an ulp


def normalized(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def directions() -> np.ndarray:
    """Unit vectors (n, 3): random, and close to axes, edges and corners of the octahedron from either side."""
    corners = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), -1).reshape(-1, 3)
    corners = corners[corners.any(axis=1)]
    tilted = [corners + tilt * np.array([1.0, -2.0, 3.0]) for tilt in (0.0, 1e-3, 1e-6, 1e-7, -1e-7)]
    return normalized(np.concatenate([*tilted, np.random.default_rng(5).normal(size=(900, 3))])).astype(np.float32)


DIRECTIONS = directions()
TILTED = np.stack([np.sin(tilts := edges(0.0, 1.5).astype(float)), 0.0 * tilts, np.cos(tilts)], -1).astype(np.float32)


def distribution(n: np.ndarray, h: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """At the angle of the rounded vectors, whose lengths the twin's formula takes for 1."""
    return twin.ggx_distribution(normalized(n), normalized(h), alpha)


def squared_errors(light: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(n, 3) of colours (n, 3), which the twin takes for a picture."""
    return np.stack(metrics.squared_errors(light[None], truth[None]), -1)[0]


def shown_error(light: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Of the three squared errors: eight operations on positive terms, and the sRGB curves' 8 ulps each."""
    exact = squared_errors(light, truth)
    apart = np.abs(metrics.shown(light) - metrics.shown(truth)).max(-1)
    curve = 16.0 * EPS
    return np.stack(
        [8 * EPS * exact[:, 0], 10 * EPS * exact[:, 1], 8 * EPS * exact[:, 2] + 2 * apart * curve + curve**2], -1
    )


CASES = {
    "brdf": {
        # A cross product of unit vectors errs by an ulp, of which 1 / alpha shows where the peak falls off.
        "ggx_distribution": Case(
            "float ggx_distribution(vec3 n, vec3 h, float a)",
            distribution,
            (np.array([[0.0, 0.0, 1.0]], np.float32), TILTED, ALPHA),
            lambda n, h, a: 16 * EPS * (1.0 + 1.0 / a) * distribution(n, h, a),
        ),
        "smith_visibility": Case(
            "float smith_visibility(float l, float v, float a)",
            lambda n_l, n_v, a: twin.smith_visibility(np.maximum(n_l, 1e-150), n_v, a),  # no light: the limit
            (UNIT, N_V, ALPHA),
            relative=12,
        ),
        "schlick_fresnel": Case(
            "vec3 schlick_fresnel(vec3 f0, float v_h)", twin.schlick_fresnel, ((UNIT,) * 3, UNIT), ulps(8)
        ),
        "powers": Case("vec4 powers(float x)", rest.powers, (UNIT,), relative=2),
        "specular_albedo": Case(
            "vec2 specular_albedo(float n, float r)", twin.specular_albedo, (N_V, ROUGHNESS), ulps(FIT)
        ),
        "specular_lobe": Case("vec2 specular_lobe(float n, float r)", twin.specular_lobe, (N_V, ROUGHNESS), ulps(FIT)),
        # The quotient reaches 10 and errs by 3 ulps of that.
        "multiple_scattering": Case(
            "vec3 multiple_scattering(vec3 f0, vec2 a)",
            twin.multiple_scattering,
            ((UNIT,) * 3, (edges(0.0, 0.5),) * 2),
            ulps(40),
        ),
        "hemisphere_radiance": Case(
            "vec3 hemisphere_radiance(vec3 s, vec3 g, float y)",
            twin.hemisphere_radiance,
            ((HALF_LIGHT,) * 3, (HALF_LIGHT,) * 3, SIGNED),
            lambda sky, ground, y: 4 * EPS * (sky + ground),
        ),
        "hemisphere_diffuse": Case(
            "vec3 hemisphere_diffuse(vec3 s, vec3 g, float y)",
            rest.hemisphere_diffuse,
            ((HALF_LIGHT,) * 3, (HALF_LIGHT,) * 3, SIGNED),
            lambda sky, ground, y: 5 * EPS * (sky + ground),
        ),
        # 1 - x^4 errs by four roundings of x^4 <= 1.
        "distance_attenuation": Case(
            "float distance_attenuation(float d, float r)",
            twin.distance_attenuation,
            (edges(0.0, 1e9), edges(0.0, 1e3)),
            lambda d, r: 12 * EPS / np.maximum(d * d, 1e-8),
        ),
        "spot_attenuation": Case(
            "float spot_attenuation(float c, float s, float o)",
            twin.spot_attenuation,
            (SIGNED, edges(0.0, 1e4), edges(-1e4, 1.0)),
            lambda c, s, o: 4 * EPS * (np.abs(c * s) + np.abs(o) + 1.0),
        ),
    },
    "color": {
        "luminance": Case(
            "float luminance(vec3 c)",
            twin.luminance,
            ((edges(-1e30, 1e30),) * 3,),
            lambda c: 4 * EPS * twin.luminance(np.abs(c)),
        ),
        "compressed_luminance": Case(
            "float compressed_luminance(vec3 c)", rest.compressed_luminance, ((LIGHT,) * 3,), ulps(8)
        ),
        "ycocg_from_rgb": Case(
            "vec3 ycocg_from_rgb(vec3 c)",
            twin.ycocg_from_rgb,
            ((HALF_LIGHT,) * 3,),
            lambda c: 2 * EPS * c.sum(-1, keepdims=True),
        ),
        "rgb_from_ycocg": Case(
            "vec3 rgb_from_ycocg(vec3 c)",
            twin.rgb_from_ycocg,
            ((edges(-6e4, 6e4),) * 3,),
            lambda c: 2 * EPS * np.abs(c).sum(-1, keepdims=True),
        ),
    },
    "tone": {
        # pow is exp2 of a product: its rounding grows with the exponent, at most log2(0.0031308) / 2.4 = 3.5
        "srgb_encode": Case("vec3 srgb_encode(vec3 c)", tone.srgb_encode, ((UNIT,) * 3,), ulps(8)),
        "tone_aces": Case("vec3 tone_aces(vec3 c)", tone.tone_aces, ((LIGHT,) * 3,), ulps(12)),
        "tone_neutral": Case("vec3 tone_neutral(vec3 c)", tone.tone_neutral, ((LIGHT,) * 3,), ulps(16)),
    },
    "errors": {
        "shown": Case("vec3 shown(vec3 c)", metrics.shown, ((edges(-1e30, 1e30),) * 3,), ulps(8)),
        "squared_errors": Case(
            "vec3 squared_errors(vec3 a, vec3 b)",
            squared_errors,
            ((HALF_LIGHT,) * 3, (HALF_LIGHT,) * 3),
            shown_error,
        ),
    },
    "colormap": {
        "sequential": Case(
            "vec3 sequential(float t)", colormap.sequential, (edges(-1e30, 1e30, np.inf, -np.inf),), lambda t: OPEN
        ),
        # positions of 0..4 are rounded once more than the colours, whose slope is below 0.5 a step
        "diverging": Case(
            "vec3 diverging(float s)", colormap.diverging, (edges(-1e30, 1e30, np.inf, -np.inf),), ulps(8)
        ),
        "signed_unit": Case(
            "float signed_unit(float v, float l, float h)",
            rowwise(colormap.signed_unit),
            (edges(-1e6, 1e6), edges(-1e6, 0.0), edges(0.0, 1e6)),
            relative=4,
        ),
        # GLSL's atan is promised to 4096 ulps, times 6 for the slope of the hue
        "wheel": Case(
            "vec3 wheel(float x, float y)", colormap.wheel, (edges(-1e30, 1e30), edges(-1e30, 1e30)), ulps(6 * 4096)
        ),
    },
    "octahedral": {
        "sign_not_zero": Case(
            "vec2 sign_not_zero(vec2 v)", octahedral.sign_not_zero, ((edges(-1e30, 1e30),) * 2,), exactly
        ),
        "octahedral_encode": Case(
            "vec2 octahedral_encode(vec3 n)", octahedral.octahedral_encode, (DIRECTIONS,), ulps(6)
        ),
        # what is normalised is no shorter than 1 / sqrt(3), so that its roundings at most double
        "octahedral_decode": Case(
            "vec3 octahedral_decode(vec2 p)", octahedral.octahedral_decode, ((SIGNED,) * 2,), ulps(8)
        ),
        "unpack_normal": Case("vec3 unpack_normal(uint b)", rest.unpack_normal, (integers(0, 2**32 - 1),), ulps(8)),
        "unpack_tangent": Case("vec4 unpack_tangent(uint b)", rest.unpack_tangent, (integers(0, 2**32 - 1),), ulps(8)),
    },
}
