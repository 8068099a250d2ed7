"""From a frame's inputs to the bytes of its uniform block (FRAME in layout.py)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..camera import Camera, Moment, lens_shear, offset, projection
from ..frame.records import Target
from ..optics import coc_scale_px, lens_point
from ..sampling import hash_u32, r2, sobol4
from ..settings import Settings, ShadingMode
from .layout import FRAME

if TYPE_CHECKING:
    from .scene import GpuScene


@dataclass(frozen=True)
class FrameInputs:
    """Everything one frame depends on beside the scene's own buffers."""

    now: Moment
    previous: Moment  # the frame before; `now` itself where the past does not count
    settings: Settings
    size: tuple[int, int]  # px
    frame_index: int
    seed: int
    near_plane: float  # m
    scene: GpuScene
    through_lens: bool  # rasterise from a lens point instead of the lens centre
    rows: tuple[int, int]  # traced view: first row and one past the last
    show: Target | None  # the target viewer's target

    @cached_property
    def lens_sample(self) -> np.ndarray:
        """This frame's Sobol point (4,): lens in the first two, pixel in the last two."""
        return sobol4(np.array([self.frame_index]), hash_u32(self.seed))[0]

    @cached_property
    def jitter_px(self) -> tuple[float, float]:
        """Sub-pixel offset of this frame's raster samples from the pixel centre."""
        if self.through_lens:
            return float(self.lens_sample[2] - 0.5), float(self.lens_sample[3] - 0.5)
        return r2(self.frame_index) if self.settings.temporal.antialias else (0.0, 0.0)

    @cached_property
    def lens_point(self) -> tuple[float, float]:
        """Where on the lens this raster frame is seen from, along the image's right and up [half diameters]."""
        if not self.through_lens:
            return 0.0, 0.0
        lens = self.settings.lens
        x, y = lens_point(
            self.lens_sample[:2], lens.blades, math.radians(lens.rotation), lens.anamorphic, lens.spherical_aberration
        )
        return float(x), float(y)

    @cached_property
    def lens_offset_m(self) -> tuple[float, float]:
        """The same in metres."""
        x, y = self.lens_point
        return x * self.settings.lens.aperture / 2, y * self.settings.lens.aperture / 2


def frame_block(inputs: FrameInputs) -> np.ndarray:
    """One FRAME record."""
    origin = inputs.scene.origin
    camera, before = (_about(origin, moment.camera) for moment in (inputs.now, inputs.previous))
    settings, lens = inputs.settings, inputs.settings.lens
    width, height = inputs.size
    view = camera.view()
    project = projection(camera.fov_y, width / height, inputs.near_plane)
    previous_project = projection(before.fov_y, width / height, inputs.near_plane)
    to_world = np.linalg.inv(view)
    shear = lens_shear(inputs.lens_offset_m, lens.focus_distance)
    seen = offset(inputs.jitter_px, inputs.size) @ project @ shear @ view
    unlit = settings.shading.mode is ShadingMode.UNLIT
    environment = inputs.scene.environment
    range_lo, range_hi = _show_range(inputs)
    values: dict[str, object] = {
        "view": view.T,
        "view_proj": seen.T,
        "view_to_world": to_world.T,
        "this_view_proj": (project @ view).T,
        "prev_view_proj": (previous_project @ before.view()).T,
        "shadow_view_proj": inputs.scene.shadow.view_proj.T,
        "near_plane": inputs.near_plane,
        "lens_eye": (to_world @ [*inputs.lens_offset_m, 0.0, 1.0])[:3],
        "tan_half_fov_y": math.tan(camera.fov_y / 2),
        "sky": settings.shading.background if unlit else environment.sky,
        "ground": settings.shading.background if unlit else environment.ground,
        "aperture": lens.aperture,
        "size_px": inputs.size,
        "inverse_size": (1.0 / width, 1.0 / height),
        "jitter_px": inputs.jitter_px,
        "coc_scale_px": coc_scale_px(lens.aperture, height, camera.fov_y),
        "inverse_focus": 1.0 / lens.focus_distance,
        "max_coc_px": settings.post.max_coc * height,
        "lens_anamorphic": lens.anamorphic,
        "lens_rotation": math.radians(lens.rotation),
        "lens_aberration": lens.spherical_aberration,
        "lens_cat_eye": lens.cat_eye,
        "lens_point": inputs.lens_point,
        "frame_index": inputs.frame_index,
        "seed": int(hash_u32(inputs.seed)),
        "exposure": 2.0**settings.shading.exposure,
        "light_count": inputs.scene.facts.lights,
        "samples_per_frame": settings.rays.samples_per_frame,
        "slice_begin": inputs.rows[0],
        "slice_end": inputs.rows[1],
        "ray_budget": settings.rays.budget,
        "max_rays": settings.rays.max_per_pixel,
        "mask_sensitivity": settings.mask.sensitivity,
        "mask_threshold": settings.mask.threshold,
        "mask_variance": settings.mask.variance,
        "mask_smoothing": settings.mask.smoothing,
        "layer_fade_px": settings.post.layer_fade,
        "focus_blend": settings.rays.focus_blend,
        "history_alpha": settings.rays.history,
        "reconstruct_radius": settings.reconstruct.radius,
        "blend_hit_ratio": settings.blend.hit_ratio,
        "blend_specular": settings.blend.specular,
        "taa_alpha": settings.temporal.alpha,
        "moved": int(inputs.now != inputs.previous),
        "history_valid": int(inputs.frame_index > 0),
        "overlay_range_lo": range_lo,
        "overlay_range_hi": range_hi,
    }
    block = np.zeros((), FRAME)
    for name in FRAME.names or ():
        block[name] = values[name]  # KeyError: a field of the layout that nothing fills
    return block


def _about(origin: np.ndarray, camera: Camera) -> Camera:
    """The camera in the space that the scene's vertices are kept in."""
    x, y, z = np.subtract(camera.eye, origin).tolist()
    return replace(camera, eye=(x, y, z))


def _show_range(inputs: FrameInputs) -> tuple[float, float]:
    """The target viewer's colour-map ends: the user's, else the target's own."""
    low, high = inputs.settings.overlay.range_low, inputs.settings.overlay.range_high
    return (low, high) if low != high or inputs.show is None else inputs.show.range
