"""What scene, camera and lens make possible: the evidence on which passes are planned or left out.

Every fact errs on the side of drawing: a CoC bound is never below a CoC that can appear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..camera import Camera
from ..optics import SKY_DEPTH, coc_px, coc_scale_px
from ..settings import Lens
from .boxes import ALPHA_MASKED, NORMAL_MAPPED, Boxes, scene_boxes, single_box
from .flatten import bounds
from .model import F64, Scene, Triangles
from .sight import sight

MAX_NEAR_PLANE = 0.02  # m: nearer than a hand holds a leaf to a lens; at 10 m a 24-bit depth step is then 0.3 mm
NEAR_SHARE = 2.5e-3  # of the scene's diagonal, for scenes smaller than a room
# Of the near plane's distance. Farther away, 24 bits that fall as 1/z count in steps of more than 1/4096 of the depth,
# 2 cm at 80 m, and what lies behind shows through.
DEEP = 4096.0
EVERY_COC_PX = 1e6  # radius of a CoC that is larger than any picture
CUT_DEPTHS = 8  # at which a jump of the camera is judged: within a factor of two of everything from a hand to a hall
_CUT_GRID = np.linspace(-0.98, 0.98, 9)  # of the picture's half width and height: a ninth of the screen apart


@dataclass(frozen=True)
class SceneFacts:
    """What stays true of a scene wherever one looks from."""

    low: tuple[float, float, float]  # bounds of all that it passes through, m, world
    high: tuple[float, float, float]
    boxes: Boxes  # that hold it more tightly
    textured: bool
    normal_mapped: bool
    emissive: bool
    alpha_masked: bool
    lights: int
    sun: bool
    objects: bool = False  # parts of it move
    deep: bool = False  # the depth test needs a logarithmic scale to tell surfaces apart from end to end


@dataclass(frozen=True)
class Facts:
    """What one frame may meet. CoC radii are upper bounds in full-resolution px, 0 where nothing can be."""

    near_coc_px: float
    far_coc_px: float
    textured: bool = False
    normal_mapped: bool = False
    emissive: bool = False
    alpha_masked: bool = False
    normal_mapped_in_view: bool = False  # rays of the last frame, traced again, may leave it; the raster does not
    alpha_masked_in_view: bool = False
    lights: int = 0
    sun: bool = False
    objects: bool = False
    deep: bool = False  # the scene is
    camera_moved: bool = False  # since last frame
    objects_moved: bool = False
    unsampled: bool = False  # pixels of a running mean still lack their first sample

    @property
    def moved(self) -> bool:
        """Whether anything on screen may have moved since last frame."""
        return self.camera_moved or self.objects_moved


def scene_facts(scene: Scene, low: F64, high: F64, boxes: Boxes | None = None) -> SceneFacts:
    """Facts of the scene alone, given its world bounds, and boxes that say more (app/scene/boxes.py) if there are."""
    used = [scene.materials[m.material] for m in scene.meshes]
    slots = ("base_color_texture", "metallic_roughness_texture", "normal_texture", "emissive_texture")
    return SceneFacts(
        low=tuple(map(float, low)),  # type: ignore[arg-type]
        high=tuple(map(float, high)),  # type: ignore[arg-type]
        boxes=boxes or single_box(low, high),
        textured=any(getattr(m, slot) is not None for m in used for slot in slots),
        normal_mapped=any(m.normal_texture is not None for m in used),
        emissive=any(max(m.emissive) > 0.0 for m in used),
        alpha_masked=any(m.alpha_cutoff is not None for m in used),
        lights=len(scene.lights),
        sun=any(light.kind == "sun" for light in scene.lights),
        objects=any(instance.motion is not None for instance in scene.instances),
        deep=float(np.linalg.norm(np.subtract(high, low))) > DEEP * near_plane(low, high),
    )


def facts_of(scene: Scene, triangles: Triangles) -> SceneFacts:
    """Facts of a scene and what it was baked to, with all that the boxes around it tell."""
    return scene_facts(scene, *bounds(triangles), scene_boxes(triangles, scene.materials))


def near_plane(low: ArrayLike, high: ArrayLike) -> float:
    """Near plane [m] of raster and rays alike: close enough for a leaf in front of the lens, and no closer than 24 bits
    of depth resolve (in scenes that are not deep).
    """
    diagonal = float(np.linalg.norm(np.subtract(high, low)))
    return min(MAX_NEAR_PLANE, max(NEAR_SHARE * diagonal, 1e-9))


def depth_range(camera: Camera, facts: SceneFacts, near_plane: float) -> tuple[float, float]:
    """Smallest and largest planar depth [m] that the scene's box can show in front of the near plane."""
    corners = np.stack(np.meshgrid(*zip(facts.low, facts.high, strict=True), indexing="ij"), -1).reshape(-1, 3)
    depths = (corners - np.asarray(camera.eye)) @ np.asarray(camera.forward)
    return max(float(depths.min()), near_plane), max(float(depths.max()), near_plane)


def is_cut(before: Camera, now: Camera, scene: SceneFacts, near_plane: float, size: tuple[int, int]) -> bool:
    """Whether the view jumped so far that nothing it shows was on screen a frame ago: a cut, after which whatever was
    accumulated is another picture's.

    Asked of a grid of pixels at depths from the scene's nearest to its farthest, since it is not yet known what they
    show. A jump that leaves a single one of them on screen, seen from the same side, is taken for motion.
    """
    if before == now:
        return False
    nearest, farthest = depth_range(now, scene, near_plane)
    slope_before = math.tan(before.fov_y / 2) * np.array([size[0] / size[1], 1.0])
    # Nearly always the middle of the picture, far away, answers at once: it stays within the earlier field of view.
    turn = math.acos(min(max(float(np.dot(before.forward, now.forward)), -1.0), 1.0))
    move = math.dist(before.eye, now.eye)
    if move < farthest and turn + math.asin(move / farthest) < math.atan(slope_before.min()):
        return False
    x, y, z = np.meshgrid(_CUT_GRID, _CUT_GRID, np.geomspace(nearest, farthest, CUT_DEPTHS), indexing="ij")
    slope = math.tan(now.fov_y / 2) * np.array([size[0] / size[1], 1.0])
    in_view = np.stack([x * slope[0] * z, y * slope[1] * z, -z], -1).reshape(-1, 3)
    away = in_view @ now.view()[:3, :3]  # from the eye, in world axes
    away_before = away + np.subtract(now.eye, before.eye)
    earlier = away_before @ before.view()[:3, :3].T
    on_screen = (np.abs(earlier[:, :2]) <= -earlier[:, 2:] * slope_before).all(axis=1)
    same_side = np.einsum("ij,ij->i", away, away_before) > 0.0
    return not bool(np.any(on_screen & same_side))


def with_every_effect(facts: Facts) -> Facts:
    """The same scene, as if blur of any size, motion and all it is made of could appear anywhere: what leaving things
    out is measured against.
    """
    seen = {"normal_mapped_in_view": facts.normal_mapped, "alpha_masked_in_view": facts.alpha_masked}
    moved = {"camera_moved": True, "objects_moved": facts.objects}
    return replace(facts, near_coc_px=EVERY_COC_PX, far_coc_px=EVERY_COC_PX, **seen, **moved)


def frame_facts(
    scene: SceneFacts,
    camera: Camera,
    lens: Lens,
    size: tuple[int, int],
    near_plane: float,
    camera_moved: bool = False,
    unsampled: bool = False,
    objects_moved: bool = False,
) -> Facts:
    """Facts of one frame of `size` px. The sky counts as far geometry: it is blurred like any."""
    seen = sight(scene.boxes, camera, lens, size, near_plane)
    scale = coc_scale_px(lens.aperture, size[1], camera.fov_y)
    near, far = (float(c) for c in coc_px([seen.nearest, SKY_DEPTH], scale, 1.0 / lens.focus_distance))
    return Facts(
        near_coc_px=max(-near, 0.0),
        far_coc_px=max(far, 0.0),
        textured=scene.textured,
        normal_mapped=scene.normal_mapped,
        emissive=scene.emissive,
        alpha_masked=scene.alpha_masked,
        normal_mapped_in_view=scene.normal_mapped and bool(seen.kinds & NORMAL_MAPPED),
        alpha_masked_in_view=scene.alpha_masked and bool(seen.kinds & ALPHA_MASKED),
        lights=scene.lights,
        sun=scene.sun,
        objects=scene.objects,
        deep=scene.deep,
        camera_moved=camera_moved,
        objects_moved=objects_moved,
        unsampled=unsampled,
    )
