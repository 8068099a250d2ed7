"""The hybrid's arithmetic in float64: twin of glsl/lib/{mask,hit_layers,reconstruct,gradient}.glsl and mask passes.

Nothing here runs when a picture is drawn: it says what the shaders must compute, so that tests can hold them to it.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

REACH_MARGIN_HALF = 1.0  # half-res px
RIM = 0.25
RAYS_BEGIN_PX, RAYS_END_PX = 2.0, 4.0
FARTHEST_TEXELS = 32.0
MOST_REACH_HALF = 16384.0  # half-res px
SETTLED_RAYS = 64.0
EDGE_WORTH = 0.1
MOST_GATHER_HALF = 6.0  # half-res px
PRIOR_RAYS = 8.0
DARK = 1e-3  # compressed luminance
DRIFT = 0.5
SAME_DEPTH_PX, SAME_DEPTH_SHARE = 1.0, 0.1

_SMOOTHING = np.array([1.0, 4.0, 6.0, 4.0, 1.0])
_DERIVATIVE = np.array([-1.0, -2.0, 0.0, 2.0, 1.0])
_RAMP = 128.0  # the Sobel kernel's answer to a slope of one per texel
_GAUSS = 3  # radius of the Gaussian, half-res px


def smoothstep(low: float, high: float, x: ArrayLike) -> Array:
    """GLSL's smoothstep."""
    t = np.clip((np.asarray(x, np.float64) - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def mask_response(gradient: ArrayLike, sensitivity: ArrayLike) -> Array:
    """Response 0..1 to a gradient (poster, 2.1)."""
    return np.asarray(1.0 - 1.0 / (np.asarray(sensitivity) * np.asarray(gradient, np.float64) + 1.0))


def own_slope(differences: ArrayLike) -> Array:
    """Slope of a surface from three successive differences (..., 3): the smallest if signs agree, else 0 (minmod)."""
    d = np.asarray(differences, np.float64)
    agree = (np.sign(d) == np.sign(d[..., :1])).all(-1)
    return np.where(agree, np.sign(d[..., 0]) * np.abs(d).min(-1), 0.0)


def edge_reach_half(coc: ArrayLike) -> Array:
    """How far [half-res px] a near surface's blur carries its edge; 0 where rays gain nothing. `coc` in full-res px."""
    coc = np.asarray(coc, np.float64)
    return np.where(coc < -RAYS_BEGIN_PX, np.minimum(-0.5 * coc + REACH_MARGIN_HALF, MOST_REACH_HALF), 0.0)


def mask_level(largest_reach: ArrayLike) -> Any:
    """How often the mask's resolution is halved, for the largest reach of an edge [half-res px]."""
    return np.maximum(np.ceil(np.log2(np.maximum(largest_reach, 1.0) / FARTHEST_TEXELS)), 0.0).astype(int)


def coarse_margin_half(side: ArrayLike) -> Array:
    """From the centre of a square of `side` half-res texels to the centre of the one in its corner [half-res px]."""
    return np.asarray(math.sqrt(0.5) * (np.asarray(side, np.float64) - 1.0))


def scouted_share(found: ArrayLike) -> Array:
    """Weight of rays where scouts hit unseen near surfaces with a share of `found`."""
    return smoothstep(0.01, 0.05, found)


def light_deviation(moments: ArrayLike) -> Array:
    """Standard deviation per ray from means (..., 4) of light and its square, of the near and of the far part."""
    m = np.asarray(moments, np.float64)
    return np.sqrt(np.maximum(m[..., 1] + m[..., 3] - (m[..., 0] + m[..., 2]) ** 2, 0.0))


def ray_weight(response: ArrayLike, deviation: ArrayLike, gain: ArrayLike) -> Array:
    """What a pixel is worth in the ray budget, 0..1; all of it while its deviation is unknown (negative)."""
    deviation, gain = np.asarray(deviation, np.float64), np.asarray(gain, np.float64)
    known = np.clip(EDGE_WORTH * np.asarray(response) + gain * deviation, 0.0, 1.0)
    return np.where((gain > 0.0) & (deviation < 0.0), 1.0, known)


def hidden_error(mean: ArrayLike) -> Array:
    """Error of compressed luminance that half an 8-bit step hides."""
    return 0.5 / 255.0 * 2.2 * np.maximum(np.asarray(mean, np.float64), 1e-3) ** (1.2 / 2.2)


def settled(deviation: ArrayLike, mean: ArrayLike, rays: ArrayLike, exposure: ArrayLike) -> NDArray[np.bool_]:
    """Whether rays leave less noise than a display shows."""
    rays = np.asarray(rays, np.float64)
    noise = np.asarray(deviation) / np.sqrt(np.maximum(rays, 1e-300)) * np.maximum(exposure, 1.0)
    return (rays >= SETTLED_RAYS) & (noise <= hidden_error(mean))


def rays_feather(power: ArrayLike, reach: ArrayLike) -> Array:
    """Weight of rays inside a reach [half-res px], from reach^2 - distance^2."""
    power, reach = np.asarray(power, np.float64), np.asarray(reach, np.float64)
    from_rim = 1.0 - np.sqrt(np.maximum(1.0 - power / reach**2, 0.0))
    return smoothstep(0.0, RIM, from_rim) * smoothstep(RAYS_BEGIN_PX, RAYS_END_PX, 2.0 * (reach - REACH_MARGIN_HALF))


def planned_rays(level: ArrayLike, scale: ArrayLike, fewest: float, most: float) -> Array:
    """Mean rays for a mask level 1..255 when the budget allows `scale` per level."""
    return np.clip(np.asarray(scale) * np.asarray(level, np.float64), fewest, most)


def catmull_rom(x: ArrayLike) -> Array:
    """Weight of a sample `x` sample distances away under the interpolating cubic."""
    x = np.abs(np.asarray(x, np.float64))
    inner, outer = 1.5 * x**3 - 2.5 * x**2 + 1.0, -0.5 * x**3 + 2.5 * x**2 - 4.0 * x + 2.0
    return np.where(x < 1.0, inner, np.where(x < 2.0, outer, 0.0))


def near_share(coc: ArrayLike, in_focus_px: float, blend: ArrayLike) -> Array:
    """Part of a hit at signed CoC radius `coc` [px] that belongs to the near layer."""
    return smoothstep(0.0, 1.0, (-np.asarray(coc, np.float64) - in_focus_px) / np.asarray(blend))


def raster_share(coc: ArrayLike, in_focus_px: float, blend: ArrayLike) -> Array:
    """Part of what lies behind the near layer that the full-resolution raster path provides."""
    full_res = 1.0 - smoothstep(RAYS_BEGIN_PX, RAYS_END_PX, np.abs(coc))
    return full_res * (1.0 - near_share(coc, in_focus_px, blend))


def post_far_share(hit_ratio: ArrayLike, threshold: float) -> Array:
    """Part of the far layer that the post-process provides."""
    return smoothstep(threshold, 1.0, hit_ratio) if threshold < 1.0 else np.zeros(np.shape(hit_ratio))


def post_near_share(specular: ArrayLike, threshold: float) -> Array:
    """Weight of the post-process where it is bright with specular near bokeh."""
    return smoothstep(threshold, 2.0 * threshold, specular)


def same_depth(coc: ArrayLike, low: ArrayLike, high: ArrayLike) -> Any:
    """Whether history of CoC `coc` may belong to a layer whose CoC now lies between `low` and `high` [px]."""
    coc, low, high = (np.asarray(x, np.float64) for x in (coc, low, high))
    margin = SAME_DEPTH_PX + SAME_DEPTH_SHARE * np.maximum(np.abs(low), np.abs(high))
    return (low <= high) & (coc >= low - margin) & (coc <= high + margin)


def light_change(before: ArrayLike, now: ArrayLike) -> Array:
    """Squared relative change of light, 0..1 (Schied, Peters and Dachsbacher 2018)."""
    before, now = np.asarray(before, np.float64), np.asarray(now, np.float64)
    change = np.abs(now - before) / np.maximum(np.maximum(before, now), DARK)
    return np.asarray(np.minimum(change**2, 1.0))


def stale_weight(least: ArrayLike, change: ArrayLike, drift: ArrayLike, coc: ArrayLike) -> Array:
    """Smallest weight of the newest rays: `least`, more where light changed or one layer's hits move apart."""
    least, change = np.asarray(least, np.float64), np.clip(np.asarray(change, np.float64), 0.0, 1.0)
    apart = np.minimum(np.asarray(drift) / (DRIFT * np.maximum(np.abs(coc), 1.0)), 1.0)
    return np.asarray(np.maximum(least + (1.0 - least) * change, apart))


def newest_weight(rays: ArrayLike, before: ArrayLike, floor_weight: ArrayLike) -> Array:
    """Weight of `rays` new samples against a mean of `before`, never below `floor_weight`; 0 without rays."""
    rays, before = np.asarray(rays, np.float64), np.asarray(before, np.float64)
    share = rays / np.maximum(rays + before, 1e-30)
    return np.where(rays > 0.0, np.maximum(share, floor_weight), 0.0)


def trusted_ratio(accumulated: ArrayLike, latest: ArrayLike, rays: ArrayLike) -> Array:
    """The accumulated hit ratio within twice the standard error of the latest one (Agresti and Coull 1998)."""
    n = np.asarray(rays, np.float64) + 2.0
    q = (np.asarray(latest, np.float64) * np.asarray(rays) + 1.0) / n
    margin = 2.0 * np.sqrt(q * (1.0 - q) / n)
    return np.clip(np.asarray(accumulated, np.float64), np.maximum(q - margin, 0.0), np.minimum(q + margin, 1.0))


def gather_radius_half(coc: ArrayLike, share: ArrayLike) -> Array:
    """Radius [half-res px] over which a layer of CoC radius `coc` [full-res px] is gathered."""
    return np.asarray(np.minimum(0.5 * np.asarray(share) * np.abs(coc), MOST_GATHER_HALF))


def reach_weight(coc: ArrayLike, distance: ArrayLike) -> Array:
    """Weight of a sample of CoC radius `coc` at `distance` [full-res px] (poster, 2.2)."""
    return np.asarray(np.clip(0.5 * (np.abs(coc) - np.asarray(distance, np.float64)) + 0.5, 0.0, 1.0))


def ray_variance(own: ArrayLike, rays: ArrayLike, pooled: ArrayLike) -> Array:
    """Variance per ray from a pixel's own rays (about their mean) and from its neighbourhood's, worth PRIOR_RAYS."""
    rays = np.asarray(rays, np.float64)
    return np.asarray((PRIOR_RAYS * np.asarray(pooled) + rays * np.asarray(own)) / (PRIOR_RAYS + rays - 1.0))


def signal_variance(spread: ArrayLike, noise: ArrayLike) -> Array:
    """Variance of the true means, from the spread of the estimated ones less their noise."""
    return np.maximum(np.asarray(spread, np.float64) - noise, 0.0)


def neighbour_share(noise: ArrayLike, signal: ArrayLike) -> Array:
    """Part of a pixel's value taken from its neighbours: local Wiener filter (Lee 1980)."""
    noise = np.asarray(noise, np.float64)
    return np.where(noise > 0.0, noise / np.where(noise > 0.0, noise + signal, 1.0), 0.0)


def mask_gradient(normal: Array, coc: Array, smoothing_px: float) -> Array:
    """|dn| + |dd| per half-res px (h/2, w/2) of full-res normals (h, w, 3) and CoC [px] (h, w); h and w even."""
    blocks = np.concatenate([normal, coc[..., None]], -1)
    h, w = coc.shape
    guide = blocks.reshape(h // 2, 2, w // 2, 2, 4).mean((1, 3))
    sigma = 0.5 * smoothing_px
    offsets = np.arange(-_GAUSS, _GAUSS + 1)
    gauss = np.exp(-0.5 * offsets**2 / max(sigma * sigma, 1e-4))
    gauss /= gauss.sum()
    reach = _GAUSS + 2
    wanted = [np.arange(-reach, n + reach) for n in guide.shape[:2]]
    within = [np.clip(i, 0, n - 1) for i, n in zip(wanted, guide.shape)]
    mirror = [np.clip(2 * j - i, 0, n - 1) for i, j, n in zip(wanted, within, guide.shape)]
    beside = 2.0 * guide[within[0]] - guide[mirror[0]]  # a plane goes on beyond the picture
    padded = 2.0 * beside[:, within[1]] - beside[:, mirror[1]]
    smooth = correlate(correlate(padded, gauss, 1), gauss, 0)
    dx = correlate(correlate(smooth, _DERIVATIVE, 1), _SMOOTHING, 0) / _RAMP
    dy = correlate(correlate(smooth, _SMOOTHING, 1), _DERIVATIVE, 0) / _RAMP
    slope_x, slope_y = 2.0 * _block_slope(coc), 2.0 * _block_slope(coc.T).T
    dn = np.sqrt((dx[..., :3] ** 2).sum(-1) + (dy[..., :3] ** 2).sum(-1))
    return np.asarray(dn + np.hypot(dx[..., 3] - slope_x, dy[..., 3] - slope_y))


def correlate(image: Array, kernel: Array, axis: int) -> Array:
    """Valid part of the correlation along an axis."""
    length = image.shape[axis] - len(kernel) + 1
    return np.asarray(sum(k * np.take(image, np.arange(i, i + length), axis) for i, k in enumerate(kernel)))


def _block_slope(coc: Array) -> Array:
    width = coc.shape[1]
    first = np.clip(np.arange(0, width, 2) - 1, 0, width - 4)
    columns = [coc[::2][:, first + i] for i in range(4)]
    return own_slope(np.stack([b - a for a, b in pairwise(columns)], -1))


def dilated(response: Array, reach: Array) -> tuple[Array, Array]:
    """Brute-force dilation of edges (h, w) by discs of their reach [half-res px]: largest response and feather."""
    h, w = response.shape
    y, x = np.mgrid[:h, :w]
    best, feather = np.zeros((h, w)), np.zeros((h, w))
    for ey, ex in np.argwhere(reach > 0.0):
        squared = (x - ex) ** 2 + (y - ey) ** 2
        power = reach[ey, ex] ** 2 - squared
        covered = power >= 0.0
        best[covered] = np.maximum(best[covered], response[ey, ex])
        feather[covered] = np.maximum(feather[covered], rays_feather(power[covered], reach[ey, ex]))
    return best, feather


def rays_per_level(histogram: ArrayLike, budget: float, most: float) -> float:
    """Rays per mask level that give the masked pixels counted in `histogram` (256,) the mean `budget`, by bisection."""
    pixels = np.asarray(histogram, np.float64)[1:]
    levels, fewest = np.arange(1, 256), min(1.0, budget)
    wanted = float(np.clip(budget, fewest, most)) * pixels.sum()
    low, high = 0.0, most
    for _ in range(60):
        middle = 0.5 * (low + high)
        enough = (pixels * planned_rays(levels, middle, fewest, most)).sum() >= wanted
        low, high = (low, middle) if enough else (middle, high)
    return high


def segment_share(distance: ArrayLike) -> Array:
    """Part of a unit disc beyond a chord at signed `distance` from its centre: what the lens sees past an edge."""
    d = np.clip(np.asarray(distance, np.float64), -1.0, 1.0)
    return np.asarray((np.arccos(d) - d * np.sqrt(1.0 - d * d)) / math.pi)
