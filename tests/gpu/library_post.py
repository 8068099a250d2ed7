"""Where the post-process's functions of glsl/lib are compared with their twins, and how closely."""

from __future__ import annotations

import numpy as np

from app.optics import SKY_DEPTH, coc_px
from app.settings import Lens, Post

from . import library_twin as rest
from . import post_twin as twin
from .edges import EPS, OPEN, Case, edges, integers, rowwise, ulps

ABERRATION = edges(-1.0, 1.0)
SIDE = edges(1.0, 32768.0, 15.0, 16.0, 17.0)
LARGEST_PX = float(Post.__dataclass_fields__["max_coc"].metadata["high"]) * 16384  # of the tallest picture
RADIUS2 = edges(0.0, LARGEST_PX**2)
COC = edges(-1e30, 1e30, np.inf, -np.inf)
LIMITED = edges(-LARGEST_PX, LARGEST_PX)
ANAMORPHIC = edges(1.0, 4.0)
BLADES = integers(0, 16)
ROTATION = edges(-np.pi, np.pi)
FRAMES = integers(0, 2**32 - 1, 13, 1022, 1023, 1024, 1025)
NEAREST_M = 1e-9  # the near plane of the smallest scene
FOCUS = Lens.__dataclass_fields__["focus_distance"].metadata
FOCI = edges(FOCUS["low"], FOCUS["high"])
ANYTHING = (edges(-3e38, 3e38, np.nan, np.inf, -np.inf, 1e30, -1e30),)
MEDIAN = """vec4 middle(vec4 a, vec4 b, float c) {
    vec4 v[9] = vec4[9](a.xxxx, a.yyyy, a.zzzz, a.wwww, b.xxxx, b.yyyy, b.zzzz, b.wwww, vec4(c));
    return median9(v);
}"""


def turned(index: np.ndarray, frame: np.ndarray, start: np.ndarray, step: float) -> np.ndarray:
    """Whether the fraction by which a frame turns or moves a ring lies so close to a whole number that rounding may
    take it to the other side: the product is below 700, and its constant and itself each round once.
    """
    part = (start + (frame & 1023) * step) % 1.0
    return np.minimum(part, 1.0 - part) < 700 * EPS


def gauge_error(k: np.ndarray, n: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Along the ring's width in squares: what the fraction errs by, or all of it where it may wrap round."""
    inner, outer = twin.ring_rim(k - 1, n), twin.ring_rim(k, n)
    wrapped = turned(k, frame, np.full(len(k), 0.5), twin.GOLDEN)
    slope = (outer**2 - inner**2) / (2.0 * np.maximum(inner, 0.1))
    return np.where(wrapped, outer - np.maximum(inner, 0.0), 700 * EPS * slope + 8 * EPS)


def tap_error(i: np.ndarray, n: np.ndarray, frame: np.ndarray, *lens: np.ndarray) -> np.ndarray:
    """Two radii where turn or gauge may wrap round, else what a driver's sine errs by."""
    k = (np.sqrt(i).astype(int) + 1) // 2
    wrapped = turned(k, frame, k * twin.GOLDEN, twin.ROOT) | turned(k, frame, np.full(len(k), 0.5), twin.GOLDEN)
    return np.where(wrapped, 2.0, 2 * OPEN)[:, None]


CASES = {
    "coc": {
        # A reciprocal of 2.5 ulps, a difference and a product: what cancels near focus is the depth's own rounding too.
        "coc_px": Case(
            "float coc_px(float z, float k, float i)",
            coc_px,
            (edges(NEAREST_M, SKY_DEPTH), edges(0.0, 1e7), np.append(1.0 / FOCI.astype(float), 0.0).astype(np.float32)),
            lambda z, k, i: 4 * EPS * k * (i + 1.0 / z),
        )
    },
    "finite": {
        "finite": Case("vec4 finite(vec4 c)", rest.finite, (ANYTHING * 4,)),
        "finite_radiance": Case("vec4 finite_radiance(vec4 c)", twin.finite_radiance, (ANYTHING * 4,)),
        "within_half": Case("vec4 within_half(vec4 c)", rest.within_half, ((edges(-3e38, 3e38),) * 4,)),
        "usable": Case(
            "uvec3 which(vec3 c)",
            rest.usable,
            (ANYTHING * 3,),
            extra="uvec3 which(vec3 c) { return uvec3(usable(c)); }",
        ),
        "is_usable": Case("bool is_usable(vec3 c)", rest.is_usable, (ANYTHING * 3,)),
    },
    "splat": {
        "gathered_coc": Case(
            "float gathered_coc(float c, float l)",
            twin.gathered_coc,
            (np.append(COC, np.float32(np.nan)), edges(0.01, LARGEST_PX)),
        ),
        "silhouette_px": Case("float silhouette_px(float a, float b)", twin.silhouette_px, (COC, COC)),
        "enclosed_light": Case(
            "float enclosed_light(float t, float s)", twin.enclosed_light, (edges(0.0, 1e30), ABERRATION), ulps(8)
        ),
        # A difference of two numbers of at most 1 after a reciprocal of 2.5 ulps, each with a slope of at most 3.
        "ring_light": Case(
            "float ring_light(float a, float b, float r, float s)",
            twin.ring_light,
            (RADIUS2, RADIUS2, RADIUS2, ABERRATION),
            ulps(24),
        ),
        "ring_area": Case("vec2 ring_area(float a, float b, float r)", twin.ring_area, (RADIUS2,) * 3, ulps(8)),
        "shrunk_px2": Case(
            "float shrunk_px2(float r, float v, float s)",
            twin.shrunk_px2,
            (edges(0.0, LARGEST_PX), edges(0.0, 2.0), edges(0.1, 0.7)),
            lambda r, v, s: 4 * EPS * (r * r + 2.0 * v / s),
        ),
        # Ring j = 9 is the last: there an ulp of the argument is 20 j^2 of the fit, and where the splat ends on a rim
        # either ring fits it as well; but from the first ring inwards nothing is fitted.
        "fitted_px2": Case(
            "float fitted(float ratio, float d, float s)",
            lambda ratio, d, s: twin.fitted_px2((ratio * d) ** 2, d, s),
            (edges(0.0, 9.0), edges(0.01, LARGEST_PX), ABERRATION),
            lambda ratio, d, s: np.where(np.abs(ratio - 1.5) < 8 * EPS, 0.05 * (ratio * d) ** 2, 0.0),
            relative=1e-3 / EPS,
            extra="float fitted(float ratio, float d, float s) { return fitted_px2((ratio * d) * (ratio * d), d, s); }",
        ),
        "fitted_even_px2": Case(
            "float fitted(float ratio, float d)",
            lambda ratio, d: twin.fitted_even_px2((ratio * d) ** 2, d),
            (edges(0.0, 9.0), edges(0.01, LARGEST_PX)),
            lambda ratio, d: np.where(np.abs(ratio - 1.5) < 8 * EPS, 0.05 * (ratio * d) ** 2, 0.0),
            relative=1e-3 / EPS,
            extra="float fitted(float ratio, float d) { return fitted_even_px2((ratio * d) * (ratio * d), d); }",
        ),
        "front_share": Case(
            "float front_share(float c, float a, float b)", twin.front_share, (COC[np.isfinite(COC)], 2.0, 4.0), ulps(8)
        ),
        # (c - n) / fade: the difference rounds once, the quotient by 2.5 ulps; the curve's slope is at most 1.5.
        "fore_share": Case(
            "float fore_share(float c, float n, float f)",
            twin.fore_share,
            (LIMITED, LIMITED, edges(0.25, 16.0)),
            ulps(16),
        ),
        # What is left open, 1 - a, errs by an ulp of 1, and is taken relative to the layer behind's own coverage.
        "stacked": Case(
            "vec4 stacked(vec4 f, vec4 b)",
            twin.stacked,
            ((*(edges(0.0, 6e4),) * 3, edges(0.0, 2.0)), (*(edges(0.0, 6e4),) * 3, edges(0.0, 2.0))),
            lambda f, b: 8 * EPS * (f + b * (1.0 + 1.0 / np.maximum(b[:, 3:], 1e-6))),
        ),
    },
    "kernel": {
        "ring_count": Case(
            "int ring_count(float r, int m)",
            twin.ring_count,
            (edges(0.0, 1e9, 1.4999999, 1.5, 1.5000001), integers(1, 8)),
        ),
        "ring_rim": Case("float ring_rim(int k, int n)", twin.ring_rim, (integers(0, 8), integers(1, 8)), relative=3),
        "ring_taps": Case("int ring_taps(int k)", rowwise(twin.ring_taps), (integers(0, 8),)),
        "kernel_taps": Case("int kernel_taps(int n)", twin.kernel_taps, (integers(0, 8),)),
        "first_tap": Case("int first_tap(int k)", rowwise(twin.first_tap), (integers(0, 8),)),
        "aperture_point": Case(
            "vec2 aperture_point(float t, float a, int b, float r, float s)",
            rowwise(twin.aperture_point),
            (edges(-4.0, 4.0), edges(0.0, 1.0), BLADES, ROTATION, ANAMORPHIC),
            lambda *_: OPEN,
        ),
        "tap_gauge": Case(
            "float tap_gauge(int k, int n, uint f)",
            rowwise(twin.tap_gauge),
            (integers(0, 8), integers(1, 8), FRAMES),
            gauge_error,
        ),
        "kernel_tap": Case(
            "vec2 kernel_tap(int i, int n, uint f, int b, float r, float a)",
            rowwise(twin.kernel_tap),
            (np.arange(81), 4, FRAMES, BLADES, ROTATION, ANAMORPHIC),
            tap_error,
        ),
    },
    "tile": {"tile_count": Case("ivec2 tile_count(vec2 s)", twin.tile_count, ((SIDE, SIDE),))},
    "tile_reach": {
        "tile_reach": Case(
            "int tile_reach(float r)", twin.tile_reach, (edges(-1e4, LARGEST_PX, 12.999999, 13.0, 29.0),)
        )
    },
    "median": {
        "order": Case(
            "vec4 ordered(float a, float b)",
            lambda a, b: np.stack([rest.order(a, b)[i // 2] for i in range(4)], -1),
            (COC, COC),
            extra="vec4 ordered(float a, float b) { vec4 x = vec4(a), y = vec4(b);"
            " order(x, y); return vec4(x.xy, y.xy); }",
        ),
        "median9": Case(
            "vec4 middle(vec4 a, vec4 b, float c)",
            lambda a, b, c: np.repeat(rest.median9([*a.T, *b.T, c])[:, None], 4, 1),
            ((COC,) * 4, (COC,) * 4, COC),
            extra=MEDIAN,
        ),
    },
}
