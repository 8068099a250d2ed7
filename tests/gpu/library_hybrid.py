"""Where the hybrid's functions of glsl/lib are compared with their twins, and how closely."""

from __future__ import annotations

import numpy as np

from app.optics import IN_FOCUS_COC_PX

from . import hybrid_twin as twin
from . import library_twin as rest
from . import shading_twin
from .edges import EPS, Case, edges, integers, rowwise, ulps

UNIT = edges(0.0, 1.0)
COC = edges(-1e30, 1e30)
BLEND = edges(0.05, 8.0)
SIDES = np.array([1, 2, 4, 8, 16, 512])
RAYS = np.array([0, 1, 2, 3, 16, 255, 256, 65535, 65536, 1_000_000], np.float32)
REACH = edges(2.1, twin.MOST_REACH_HALF)
LENGTHS = edges(0.0, 1e9)


def layer_error(coc: np.ndarray, in_focus: float, blend: np.ndarray) -> np.ndarray:
    """A sum, and a quotient of 2.5 ulps, both relative to the CoC over the blend where the share is neither 0 nor 1."""
    return 8 * EPS * (1.0 + (np.minimum(np.abs(coc), in_focus + blend) + in_focus) / blend)


def unsettled(d: np.ndarray, m: np.ndarray, r: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Either answer will do where noise and what hides it agree to 32 ulps."""
    noise = d / np.sqrt(np.maximum(r, 1.0)) * np.maximum(e, 1.0)
    return 1.0 * (np.abs(noise - twin.hidden_error(m)) <= 32 * EPS * noise)


def undecided(coc: np.ndarray, circle: np.ndarray) -> np.ndarray:
    """1 where a CoC lies within rounding of the end of its range."""
    low, high = circle.T
    margin = twin.SAME_DEPTH_PX + twin.SAME_DEPTH_SHARE * np.maximum(np.abs(low), np.abs(high))
    near = np.minimum(np.abs(coc - (low - margin)), np.abs(coc - (high + margin)))
    return (near <= 8 * EPS * (np.abs(circle).max(-1) + margin)).astype(float)


def whole(p: np.ndarray, farthest: np.ndarray, side: np.ndarray, size: np.ndarray) -> np.ndarray:
    """1 where the grown reach lies within rounding of a whole number."""
    reach = farthest + np.sqrt(0.5) * (side - 1)
    return (np.abs(reach - np.rint(reach)) <= 2 * EPS * (reach + 1)).astype(float)[:, None]


def deviation_error(moments: np.ndarray) -> np.ndarray:
    """The variance errs by a few ulps of its terms; its root by that over itself, or by the root of that."""
    error = 8 * EPS * (moments[:, 1] + moments[:, 3] + (moments[:, 0] + moments[:, 2]) ** 2)
    return error / np.maximum(twin.light_deviation(moments), np.sqrt(error) + 1e-300) + 4 * EPS


def level_error(largest: np.ndarray) -> np.ndarray:
    """1 where the reach lies within a logarithm's rounding of a power of two: either side's resolution will do."""
    octave = np.log2(np.maximum(largest, 1.0) / twin.FARTHEST_TEXELS)
    return (np.abs(octave - np.rint(octave)) < 1e-5).astype(float)


CASES = {
    "mask": {
        "mask_response": Case(
            "float mask_response(float g, float s)", twin.mask_response, (LENGTHS, edges(0.01, 100.0)), ulps(4)
        ),
        "own_slope": Case("float own_slope(vec3 d)", twin.own_slope, ((COC,) * 3,)),
        "edge_reach_half": Case(
            "float edge_reach_half(float c)",
            twin.edge_reach_half,
            (edges(-1e30, 1e30, np.inf, -np.inf, -131006.0, -32766.0, -32765.9),),
            relative=2,
        ),
        "mask_level": Case(
            "int mask_level(float r)", twin.mask_level, (edges(0.0, twin.MOST_REACH_HALF),), level_error
        ),
        "coarse_margin_half": Case("float coarse_margin_half(int s)", twin.coarse_margin_half, (SIDES,), relative=2),
        "coarse_center": Case("float coarse_center(int i, int s)", rest.coarse_center, (integers(0, 32), SIDES)),
        "coarse_span": Case(
            "ivec2 coarse_span(int p, float f, int side, int size)",
            rest.coarse_span,
            (integers(0, 8191), edges(0.0, twin.MOST_REACH_HALF), SIDES, integers(1, 8192)),
            whole,
        ),
        # 1 - sqrt(1 - x) loses digits near x = 1: sqrt(4 ulps) at worst, times the smoothstep's slope 1.5 / RIM.
        "rays_feather": Case(
            "float feather(float share, float r)",
            lambda share, r: twin.rays_feather(share * r * r, r),
            (edges(-0.5, 1.0), REACH),
            lambda share, r: 1.5 / twin.RIM * 2.0**-10,
            extra="float feather(float share, float r) { return rays_feather(share * r * r, r); }",
        ),
        "scouted_share": Case("float scouted_share(float f)", twin.scouted_share, (UNIT,), ulps(16)),
        "light_deviation": Case("float light_deviation(vec4 m)", twin.light_deviation, ((UNIT,) * 4,), deviation_error),
        "ray_weight": Case(
            "float ray_weight(float r, float d, float g)",
            twin.ray_weight,
            (UNIT, edges(-1.0, 0.5), edges(0.0, 100.0)),
            lambda r, d, g: 4 * EPS * (0.1 + g * np.abs(d)),
        ),
        # pow by exp2 and log2: the exponent's ulps at 2^-10 count ten times.
        "hidden_error": Case("float hidden_error(float m)", twin.hidden_error, (UNIT,), ulps(32)),
        "settled": Case(
            "bool settled(float d, float m, float r, float e)",
            twin.settled,
            (edges(0.0, 0.5), UNIT, RAYS, edges(1e-3, 100.0)),
            unsettled,
        ),
        "planned_rays": Case(
            "float planned_rays(float l, float s, float f, float m)",
            rowwise(twin.planned_rays),
            (integers(1, 255).astype(np.float32), edges(0.0, 256.0), edges(0.25, 1.0), edges(1.0, 256.0)),
            relative=1,
        ),
    },
    "hit_layers": {
        "near_share": Case(
            "float near_share(float c, float f, float b)", twin.near_share, (COC, IN_FOCUS_COC_PX, BLEND), layer_error
        ),
        "raster_share": Case(
            "float raster_share(float c, float f, float b)",
            twin.raster_share,
            (COC, IN_FOCUS_COC_PX, BLEND),
            lambda c, f, b: 16 * EPS + layer_error(c, f, b),
        ),
        # Differences of neighbouring numbers are exact; the quotient errs by 2.5 ulps, the curve's slope is 1.5.
        "post_far_share": Case(
            "float post_far_share(float r, float t)", rowwise(twin.post_far_share), (UNIT, edges(0.01, 1.0)), ulps(12)
        ),
        "post_near_share": Case(
            "float post_near_share(float s, float t)",
            rowwise(twin.post_near_share),
            (edges(0.0, 6e4), edges(0.1, 100.0)),
            ulps(12),
        ),
        "same_depth": Case(
            "bool same_depth(float c, vec2 r)",
            lambda c, r: twin.same_depth(c, r[:, 0], r[:, 1]),
            (edges(-100.0, 100.0), (edges(-100.0, 100.0, np.inf), edges(-100.0, 100.0, -np.inf))),
            undecided,
        ),
        "newest_weight": Case(
            "float newest_weight(float r, float b, float f)", twin.newest_weight, (RAYS, RAYS, UNIT), ulps(4)
        ),
        # Near a ratio of 1 the root's argument errs by an ulp of 1 over n, and is at least 1 / n^2 itself.
        "trusted_ratio": Case(
            "float trusted_ratio(float a, float l, float r)", twin.trusted_ratio, (UNIT, UNIT, RAYS), ulps(16)
        ),
    },
    "reconstruct": {
        "gather_radius_half": Case(
            "float gather_radius_half(float c, float s)", twin.gather_radius_half, (COC, UNIT), relative=2
        ),
        "reach_weight": Case(
            "float reach_weight(float c, float d)",
            twin.reach_weight,
            (COC, edges(0.0, 1e4)),
            lambda c, d: 2 * EPS * (np.minimum(np.abs(c), d + 1.0) + d + 1.0),
        ),
        "ray_variance": Case(
            "float ray_variance(float o, float r, float p)", twin.ray_variance, (LENGTHS, RAYS, LENGTHS), relative=8
        ),
        "signal_variance": Case(
            "float signal_variance(float s, float n)", twin.signal_variance, (LENGTHS, LENGTHS), relative=1
        ),
        "neighbour_share": Case(
            "float neighbour_share(float n, float s)", twin.neighbour_share, (LENGTHS, LENGTHS), ulps(4)
        ),
    },
    "gradient": {
        "light_change": Case("float light_change(float b, float n)", twin.light_change, (UNIT, UNIT), relative=10),
        "stale_weight": Case(
            "float stale_weight(float l, float c, float d, float r)",
            twin.stale_weight,
            (edges(0.005, 1.0), edges(-0.5, 1.5), edges(0.0, 1e4), COC),
            ulps(8),
        ),
    },
    "catmull_rom": {
        # The outer branch adds terms of 8, 10 and 4.
        "catmull_rom": Case("float catmull_rom(float x)", twin.catmull_rom, (edges(-1e30, 1e30),), ulps(16)),
        "catmull_rom_weights": Case(
            "vec4 weights(float f)",
            rest.catmull_rom_weights,
            (UNIT,),
            ulps(8),
            extra="vec4 weights(float f) { vec2 a, b, c, d; catmull_rom_weights(vec2(f), a, b, c, d);"
            " return vec4(a.x, b.y, c.x, d.y); }",
        ),
        "clip_to_box": Case(
            "vec3 clip_to_box(vec3 p, vec3 c, vec3 r)",
            shading_twin.clip_to_box,
            ((edges(-6e4, 6e4),) * 3, (edges(-6e4, 6e4),) * 3, (edges(0.0, 6e4),) * 3),
            lambda p, c, r: 4 * EPS * (np.abs(p) + 2.0 * np.abs(c)),
        ),
    },
}
