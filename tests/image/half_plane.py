"""A near half-plane in front of the sky: what part of the lens it covers is known in closed form."""

from __future__ import annotations

import math

import moderngl
import numpy as np

from app.camera import Camera
from app.optics import coc_px, coc_scale_px

from ..gpu.small_scenes import quad, scene_of
from .stage import Stage, stage_of

SIZE = (64, 36)
CAMERA = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), math.radians(40))
FOCUS, NEAR = 2.0, 1.0  # m
RADIUS_PX = 8.0  # of the near half-plane's blur
DIRECTION = math.radians(25)  # of its edge's normal, from right towards up: nothing that a flip would keep
EDGE_PX = 3.0  # of the edge from the picture's centre


def half_plane(ctx: moderngl.Context) -> Stage:
    """A near half-plane in front of the sky."""
    metre = SIZE[1] / (2 * NEAR * math.tan(CAMERA.fov_y / 2))  # px per metre
    normal = np.array([math.cos(DIRECTION), math.sin(DIRECTION), 0.0])
    along = 10.0 * np.array([-normal[1], normal[0], 0.0])
    corner = normal * EDGE_PX / metre - along / 2 - 10.0 * normal + (0.0, 0.0, -NEAR)
    of_a_metre = float(coc_px(NEAR, coc_scale_px(1.0, SIZE[1], CAMERA.fov_y), 1.0 / FOCUS))
    lens = {"lens__aperture": -RADIUS_PX / of_a_metre, "lens__focus_distance": FOCUS, "shading__mode": "unlit"}
    return stage_of(ctx, scene_of([quad(tuple(corner), tuple(10.0 * normal), tuple(along))]), CAMERA, **lens)


def covered() -> np.ndarray:
    """Share of the lens (h, w) that the half-plane covers: the segment of a disc beyond a chord."""
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2, SIZE[1] / 2 - 0.5 - np.arange(SIZE[1]))
    chord = np.clip((EDGE_PX - x * math.cos(DIRECTION) - y * math.sin(DIRECTION)) / RADIUS_PX, -1.0, 1.0)
    return 0.5 + (chord * np.sqrt(1.0 - chord**2) + np.arcsin(chord)) / math.pi
