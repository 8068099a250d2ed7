"""Where the lens, sampling and bookkeeping functions of glsl/lib are compared with their twins, and how closely."""

from __future__ import annotations

import numpy as np

from app import optics, sampling

from . import library_twin as rest
from .edges import EPS, Case, edges, integers, rowwise

# Angles reach 2 pi, where a float32 is 5e-7 coarse; drivers' sine, cosine and arctangent add as much again.
ANGULAR = 4e-6
SQUARE = (edges(0.0, 1.0), edges(0.0, 1.0))
ABERRATION = edges(-1.0, 1.0)
ROTATION = edges(-np.pi, np.pi)
ANAMORPHIC = edges(1.0, 4.0)
BLADES = integers(0, 16)
WORDS = integers(0, 2**32 - 1)
PIXELS = integers(0, 16383)
NOT_SMALL = edges(0.01, 2.0)


def area_error(u: np.ndarray, s: np.ndarray) -> np.ndarray:
    """The quadratic (1 - s) t + s t^2 = u errs by a few ulps: t by that over its slope, or by the root over |s| where
    the slope vanishes, at t = 1 for s = -1.
    """
    slope = np.maximum(1.0 + s * (2.0 * optics.aberrated_area(u, 0.0) - 1.0), 0.0)
    t = np.minimum(np.maximum(u, 0.0), 1.0)
    slope = np.minimum(slope, np.sqrt(np.maximum((1.0 - s) ** 2 + 4.0 * s * t, 0.0)))
    error = 16.0 * EPS
    return np.minimum(error / np.maximum(slope, 1e-30), 2.0 * np.sqrt(error / np.maximum(np.abs(s), 1e-30)))


def lens_error(
    square: np.ndarray, blades: np.ndarray, rotation: np.ndarray, a: np.ndarray, s: np.ndarray
) -> np.ndarray:
    """Angles as the driver has them; the radius as the redistributed area has it, whose root halves what it errs by."""
    u = np.where(blades < 3, np.sum(optics.concentric_disc(square) ** 2, -1), square[:, 1])
    return (4.0 * ANGULAR + np.minimum(area_error(u, s), np.sqrt(area_error(u, s))))[:, None]


def rim_error(point: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Sum and root err by ulps of the longer, and what is left of 1 - |shift|^2 by an ulp of 1."""
    square, along = np.sum(point * point, -1), np.sum(point * shift, -1)
    root = np.sqrt(along**2 + square * np.maximum(1.0 - np.sum(shift * shift, -1), 0.0))
    return 8 * EPS * ((np.abs(along) + root + np.sqrt(square)) / square + 1.0 / root)


def undecided(point: np.ndarray, shift: np.ndarray) -> np.ndarray:
    apart = np.sum((point - shift) ** 2, -1)
    return (np.abs(apart - 1.0) <= 8 * EPS).astype(float)


def mean_error(mean: np.ndarray, withheld: np.ndarray, value: np.ndarray) -> np.ndarray:
    """One rounding of the mean, which is withheld for the next call, and three of the step; none of the count."""
    step = np.where(rest.usable(value), np.abs(value), 0.0) + np.abs(mean[:, :3])
    error = EPS * (np.abs(mean[:, :3]) + 4.0 * step / (mean[:, 3:] + 1.0) + np.abs(withheld))
    return np.concatenate([error, np.zeros((len(mean), 1))], -1)


CASES = {
    "lens": {
        "concentric_disc": Case("vec2 concentric_disc(vec2 s)", optics.concentric_disc, (SQUARE,), lambda s: ANGULAR),
        "aberrated_area": Case(
            "float aberrated_area(float u, float s)",
            rowwise(optics.aberrated_area),
            (edges(0.0, 1.0), ABERRATION),
            area_error,
        ),
        "polygon_point": Case(
            "vec2 polygon_point(vec2 s, int b, float r)",
            rowwise(optics.polygon_point),
            (SQUARE, integers(3, 16), ROTATION),
            lambda *_: 4 * ANGULAR,
        ),
        "lens_point": Case(
            "vec2 lens_point(vec2 s, int b, float r, float a, float w)",
            rowwise(optics.lens_point),
            (SQUARE, BLADES, ROTATION, ANAMORPHIC, ABERRATION),
            lens_error,
        ),
        "lens_spread": Case(
            "float lens_spread(int b, float a, float s)",
            rowwise(optics.lens_spread),
            (BLADES, ANAMORPHIC, ABERRATION),
            lambda *_: ANGULAR,
        ),
        # 2 p - size cancels to an ulp of the size, over the size's length.
        "barrel_shift": Case(
            "vec2 barrel_shift(vec2 p, vec2 size, float c)",
            rowwise(optics.barrel_shift),
            (
                (edges(0.0, 16384.0),) * 2,
                np.array([[1, 1], [1, 16384], [16384, 1], [640, 360], [7680, 4320]], float),
                edges(0.0, 1.0),
            ),
            lambda p, size, c: 4 * EPS * (np.abs(2.0 * p) + size) / np.linalg.norm(size, axis=-1, keepdims=True),
        ),
        "passes_barrel": Case(
            "bool passes_barrel(vec2 p, vec2 s)",
            optics.passes_barrel,
            ((ABERRATION,) * 2, (ABERRATION,) * 2),
            undecided,
        ),
        "barrel_reach": Case(
            "float barrel_reach(vec2 p, vec2 s)",
            optics.barrel_reach,
            ((NOT_SMALL, edges(-2.0, 2.0)), (edges(-0.7, 0.7), edges(-0.7, 0.7))),
            rim_error,
        ),
    },
    "sampling": {
        "hash_u32": Case("uint hash_u32(uint h)", sampling.hash_u32, (WORDS,)),
        "pixel_seed": Case(
            "uint pixel_seed(uvec2 p, uint s)",
            rowwise(lambda p, s: sampling.pixel_seed(p[0], p[1], s)),
            ((PIXELS, PIXELS), WORDS),
        ),
        "owen_scramble": Case(
            "uvec4 owen_scramble(uvec4 x, uvec4 s)", sampling.owen_scramble, ((WORDS,) * 4, (WORDS,) * 4)
        ),
        "sobol4": Case("vec4 sobol4(uint i, uint s)", sampling.sobol4, (WORDS, WORDS)),
    },
    "running_mean": {
        "add_sample": Case(
            "vec4 added(vec4 m, vec3 w, vec3 v)",
            rest.add_sample,
            (
                (*(edges(0.0, 1e30),) * 3, np.array([0, 1, 2, 99, 65535, 2**23], np.float32)),
                (edges(-1e-3, 1e-3),) * 3,
                (edges(-1e30, 1e30, np.nan, np.inf, -np.inf),) * 3,
            ),
            mean_error,
            extra="vec4 added(vec4 m, vec3 w, vec3 v) { add_sample(m, w, v); return m; }",
        )
    },
    "work_list": {
        "folded_groups": Case("uvec2 folded_groups(uint n)", rest.folded_groups, (integers(0, 2**30),)),
        "group_of": Case("uint group_of(uvec2 g)", rest.group_of, ((integers(0, 32767), integers(0, 1023)),)),
        "groups_over": Case("uvec2 groups_over(uint n)", rest.groups_over, (integers(0, 2**31),)),
        "item_of": Case(
            "uint item_of(uvec2 g, uint l)", rest.item_of, ((integers(0, 32767), integers(0, 1023)), integers(0, 63))
        ),
        "list_place": Case(
            "uint list_place(uint c, uint s, uint n)", rest.list_place, (integers(0, 4), integers(0, 2**20), 2**22)
        ),
    },
}
