"""From a scene's name to something a renderer can draw, and from options to a viewpoint and settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from .bvh.cache import cached_tree
from .bvh.top import scene_tree
from .camera import Viewpoint, look_at
from .errors import UserError
from .gpu.context import Context
from .gpu.scene import GpuScene
from .scene.flatten import flatten
from .scene.load import load_scene
from .scene.model import Scene, Triangles
from .settings import Lens, Settings, put

Progress = Callable[[str, float], None]

FRAMING_FOV_DEG = 45.0  # a scene without a camera is framed with a normal lens ...
FRAMING_APERTURE = 0.01  # ... whose opening is this share of the scene's diagonal, so that blur is visible at any scale


def open_scene(name: str, progress: Progress | None = None) -> tuple[Scene, Triangles]:
    """Load a built-in scene or a file and bake it to world space. Raises UserError."""
    scene = load_scene(name, progress)
    triangles = flatten(scene)
    if scene.instances and not len(triangles.indices):
        raise UserError(f"{scene.report.source} places no triangle that could be drawn: give its nodes a size.")
    return scene, triangles


def load_gpu_scene(ctx: Context, name: str, progress: Progress | None = None) -> tuple[Scene, GpuScene]:
    """Load a scene and upload it. The BVH is built, or read from the cache, when rays are first asked for."""
    scene, triangles = open_scene(name, progress)
    return scene, on_gpu(ctx, scene, triangles)


def on_gpu(ctx: Context, scene: Scene, triangles: Triangles) -> GpuScene:
    """The same for a scene that was opened before."""
    return GpuScene(ctx, scene, triangles, partial(scene_tree, triangles, cached_tree))


def viewpoints(scene: Scene, triangles_bounds: tuple[np.ndarray, np.ndarray]) -> list[Viewpoint]:
    """The scene's own cameras, or one that frames its bounds if it has none."""
    own = [
        Viewpoint(
            look_at(c.eye, c.target, c.up, c.fov_y_deg), c.focus_distance, c.aperture, c.name or f"camera {i + 1}"
        )
        for i, c in enumerate(scene.cameras)
    ]
    return own or [framing(*triangles_bounds)]


def framing(low: np.ndarray, high: np.ndarray) -> Viewpoint:
    """A viewpoint from the front, slightly above, that holds the box, focused on its middle."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    centre, diagonal = (low + high) / 2, max(float(np.linalg.norm(high - low)), 1e-6)
    distance = 0.5 * diagonal / math.tan(math.radians(FRAMING_FOV_DEG / 2))
    direction = np.array([0.35, 0.25, 0.9])
    eye = centre + distance * direction / np.linalg.norm(direction)
    camera = look_at(tuple(eye), tuple(centre), fov_y_deg=FRAMING_FOV_DEG)
    return Viewpoint(camera, float(distance), FRAMING_APERTURE * diagonal, "framing")


def focused(settings: Settings, view: Viewpoint, given: Mapping[str, Any] | None = None) -> Settings:
    """`settings` with the viewpoint's focus and aperture, then with the options `given` by the user, which win."""
    own = {"focus_distance": view.focus_distance, "aperture": view.aperture}
    fitting = {f"lens.{name}": in_lens_range(name, value) for name, value in own.items() if value is not None}
    for path, value in {**fitting, **(given or {})}.items():
        settings = put(settings, path, value)
    return settings


def in_lens_range(name: str, value: float) -> float:
    """A lens setting brought into its range: what a scene of any size suggests must survive being saved and read."""
    allowed = Lens.__dataclass_fields__[name].metadata
    return min(max(value, allowed["low"]), allowed["high"])
