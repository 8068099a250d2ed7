"""Float64 twins of glsl/lib/brdf.glsl, color.glsl and catmull_rom.glsl: the same names over arrays."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from app.gpu.shaders import load_glsl

DIELECTRIC_F0 = 0.04


def ggx_distribution(n: ArrayLike, h: ArrayLike, alpha: ArrayLike) -> np.ndarray:
    """Walter et al. 2007, equation 33, in terms of the cosine alone."""
    cosine, a2 = np.sum(np.asarray(n, float) * h, -1), np.asarray(alpha, float) ** 2
    return a2 / (np.pi * (cosine**2 * (a2 - 1) + 1) ** 2)


def smith_visibility(n_l: ArrayLike, n_v: ArrayLike, alpha: ArrayLike) -> np.ndarray:
    """G / (4 n.l n.v) from Heitz 2014, equation 99: G = 1 / (1 + Lambda(v) + Lambda(l))."""
    n_l, n_v, a2 = (np.asarray(x, float) for x in (n_l, n_v, np.asarray(alpha, float) ** 2))
    over = lambda c: 0.5 * (np.sqrt(1 + a2 * (1 / c**2 - 1)) - 1)  # noqa: E731
    return 1 / ((1 + over(n_l) + over(n_v)) * 4 * n_l * n_v)


def schlick_fresnel(f0: ArrayLike, v_h: ArrayLike) -> np.ndarray:
    f0 = np.asarray(f0, float)
    return f0 + (1 - f0) * ((1 - np.asarray(v_h, float)) ** 5)[..., None]


def distance_attenuation(distance_m: ArrayLike, inverse_range: ArrayLike) -> np.ndarray:
    d = np.asarray(distance_m, float)
    return np.clip(1 - (d * inverse_range) ** 4, 0, 1) / np.maximum(d**2, 1e-8)


def spot_attenuation(cosine: ArrayLike, scale: ArrayLike, offset: ArrayLike) -> np.ndarray:
    return np.clip(np.asarray(cosine, float) * scale + offset, 0, 1) ** 2


@lru_cache
def specular_integrals(n_v: float, roughness: float, n: int = 48) -> tuple[float, float, np.ndarray]:
    """(scale of f0, offset, mean direction) of what microfacets reflect of uniform light.

    Stratified sampling of the microfacets the viewer sees (Heitz 2018, listing 1), which leaves only the smooth ratio
    of masking terms to average. The view lies in the xz plane, the normal is z.
    """
    a = roughness**2
    u, v = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(2 * n) + 0.5) / (2 * n))
    view = np.array([np.sqrt(1 - n_v**2), 0, n_v])
    stretched = np.array([a * view[0], 0, view[2]]) / np.hypot(a * view[0], view[2])
    across = np.array([0.0, 1.0, 0.0])
    x, y = np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v)
    share = 0.5 * (1 + stretched[2])
    y = (1 - share) * np.sqrt(np.maximum(1 - x**2, 0)) + share * y
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    h = x[..., None] * across + y[..., None] * np.cross(stretched, across) + z[..., None] * stretched
    h = h * [a, a, 1]
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    v_h = h @ view
    light = 2 * v_h[..., None] * h - view
    n_l = np.where(light[..., 2] > 0, light[..., 2], 1)
    alone = 2 * n_v / (n_v + np.sqrt(a * a + (1 - a * a) * n_v**2))  # masking towards the viewer only
    weight = np.where(light[..., 2] > 0, smith_visibility(n_l, n_v, a) * 4 * n_l * n_v / alone, 0)
    grazing = np.clip(1 - v_h, 0, 1) ** 5
    return (
        float((weight * (1 - grazing)).mean()),
        float((weight * grazing).mean()),
        (weight[..., None] * light).mean((0, 1)) / weight.mean(),
    )


def _fit(name: str, n_v: ArrayLike, roughness: ArrayLike) -> np.ndarray:
    """A polynomial of brdf.glsl, its coefficients read from there: there is no second copy of them."""
    text = re.search(rf"const mat4 {name} = mat4\(([^)]*)\)", load_glsl()["lib/brdf.glsl"])
    assert text, name
    matrix = np.array([float(x) for x in text[1].split(",")]).reshape(4, 4).T  # GLSL lists columns
    x, r = np.exp(-4 * np.asarray(n_v, float)), np.asarray(roughness, float)
    return np.einsum(
        "i...,ij,j...->...",
        x ** np.arange(4).reshape(-1, *(1,) * x.ndim),
        matrix,
        r ** np.arange(4).reshape(-1, *(1,) * r.ndim),
    )


def specular_albedo(n_v: ArrayLike, roughness: ArrayLike) -> np.ndarray:
    total = np.clip(_fit("ALBEDO_TOTAL", n_v, roughness), 0, 1)
    offset = np.clip(_fit("ALBEDO_OFFSET", n_v, roughness), 0, total)
    return np.stack([total - offset, offset], -1)


def multiple_scattering(f0: ArrayLike, albedo: ArrayLike) -> np.ndarray:
    """(n, 3) for f0 (n, 3) and albedo (n, 2)."""
    total = np.clip(np.sum(np.asarray(albedo, float), -1, keepdims=True), 0.1, 1)
    return 1 + np.asarray(f0, float) * (1 / total - 1)


def specular_lobe(n_v: ArrayLike, roughness: ArrayLike) -> np.ndarray:
    return np.stack([_fit(f"LOBE_{k}", n_v, roughness) for k in ("REFLECTED", "NORMAL")], -1)


def hemisphere_radiance(sky: ArrayLike, ground: ArrayLike, y: ArrayLike) -> np.ndarray:
    share = 0.5 + 0.5 * np.asarray(y, float)[..., None]
    return np.asarray(ground, float) * (1 - share) + np.asarray(sky, float) * share


def luminance(rgb: ArrayLike) -> np.ndarray:
    return np.asarray(rgb, float) @ np.array([0.2126, 0.7152, 0.0722])


YCOCG = np.array([[0.25, 0.5, 0.25], [0.5, 0.0, -0.5], [-0.25, 0.5, -0.25]])


def ycocg_from_rgb(c: ArrayLike) -> np.ndarray:
    return np.asarray(c, float) @ YCOCG.T


def rgb_from_ycocg(c: ArrayLike) -> np.ndarray:
    return np.asarray(c, float) @ np.linalg.inv(YCOCG).T


def catmull_rom(f: ArrayLike) -> np.ndarray:
    """The four weights (n, 4) of the interpolating cubic with tangents (p[+1] - p[-1]) / 2."""
    basis = 0.5 * np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]], float)
    return np.stack([np.asarray(f, float) ** k for k in range(4)], -1) @ basis.T


def clip_to_box(point: ArrayLike, centre: ArrayLike, reach: ArrayLike) -> np.ndarray:
    away = np.asarray(point, float) - centre
    beyond = np.max(np.abs(away) / np.maximum(reach, 1e-6), -1, keepdims=True)
    return np.asarray(centre, float) + away / np.maximum(beyond, 1)
