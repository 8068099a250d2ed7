"""Through which share of the lens each pixel sees what is nearer, and what is farther, than the focus zone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..renderer import Renderer
from ..settings import Lens
from .regions import focus_zone_m


class LensShares:
    """Counts over the frames of the `reference` view, each of which sees the scene from one point of the lens."""

    def __init__(self, size: tuple[int, int], lens: Lens, camera: Camera) -> None:
        shape = size[1], size[0]
        self._zone = focus_zone_m(lens, size[1], camera.fov_y)
        self._barrel = lens.cat_eye > 0.0
        self._near, self._far, self._points = (np.zeros(shape, np.float32) for _ in range(3))

    def restart(self) -> None:
        """The view's running mean begins again; what was counted stays."""
        self._seen = np.zeros_like(self._points)

    def add(self, renderer: Renderer) -> None:
        """Count the frame that was drawn last."""
        depth = renderer.read("depth")[::-1, :, 0]
        counts: NDArray[np.bool_] | bool = True
        if self._barrel:  # which blocks some lens points at some pixels; the view counts those that pass
            points = renderer.read("reference")[::-1, :, 3]
            counts, self._seen = points > self._seen, points
        self._near += (depth < self._zone[0]) & counts
        self._far += (depth > self._zone[1]) & counts
        self._points += counts

    @property
    def shares(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(near, far), each (h, w), 0 to 1."""
        points = np.maximum(self._points, np.float32(1.0))
        return np.divide(self._near, points), np.divide(self._far, points)
