"""The parts of a picture where depth of field goes wrong in different ways.

Each pixel of a reference knows through which share of the lens it sees something nearer than the focus zone, and
through which something farther. Two thresholds on these shares part the picture: every pixel is in exactly one region,
so that sums over the regions are sums over the picture.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..optics import IN_FOCUS_COC_PX, coc_scale_px
from ..settings import Lens

# Shares of the lens between which a pixel counts as seeing both a thing and what is behind it: one lens point in fifty,
# which is less than a level of 255 in most pictures.
BOTH_SIDES = (0.02, 0.98)

# In the order of their labels. "Hardly" is at most 2 % of the lens, "nearly all" is 98 %.
REGIONS = {
    "in_focus": "hardly any of the lens sees anything nearer or farther than the focus zone",
    "far_blur": "part of the lens sees something behind the focus zone, hardly any something in front of it",
    "near_silhouettes": "part of the lens sees something in front of the focus zone, the rest sees what is behind that",
    "near_blur": "nearly all of the lens sees what is in front of the focus zone",
}


def focus_zone_m(lens: Lens, height_px: float, fov_y: float) -> tuple[float, float]:
    """Planar depths [m] between which the blur is less than a pixel (IN_FOCUS_COC_PX), for a picture `height_px` high
    and a vertical field of view `fov_y` [rad]; the far end may be infinite.

    coc = K (1/d - 1/z) falls to -c at 1/z = 1/d + c/K and rises to c at 1/z = 1/d - c/K.
    """
    scale = coc_scale_px(lens.aperture, height_px, fov_y)
    if scale == 0.0:
        return 0.0, np.inf
    inverse, slack = 1.0 / lens.focus_distance, IN_FOCUS_COC_PX / scale
    return 1.0 / (inverse + slack), 1.0 / (inverse - slack) if inverse > slack else np.inf


def region_labels(near: ArrayLike, far: ArrayLike) -> NDArray[np.uint8]:
    """Which of REGIONS (0, 1, ...) each pixel (h, w) is in, from the shares (h, w) of the lens that see something
    nearer and something farther than the focus zone.
    """
    near, far, (hardly, nearly_all) = np.asarray(near), np.asarray(far), BOTH_SIDES
    in_focus, far_blur, near_silhouettes, near_blur = (np.uint8(i) for i in range(len(REGIONS)))
    behind = np.where(far > hardly, far_blur, in_focus)
    return np.where(near >= nearly_all, near_blur, np.where(near > hardly, near_silhouettes, behind)).astype(np.uint8)


def region_masks(labels: NDArray[np.uint8]) -> dict[str, NDArray[np.bool_]]:
    """The pixels (h, w) of each region by name."""
    return {name: labels == label for label, name in enumerate(REGIONS)}
