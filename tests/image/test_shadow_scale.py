"""Shadows of the sun at every scale and place: nothing shadows itself, and what is just above a surface still does."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest
import trimesh

from app.camera import look_at
from app.gpu.shadow import SIZE as MAP_SIZE
from app.scene.model import Environment, Light, Mesh, Scene
from app.settings import put
from tests.gpu.small_scenes import quad, scene_of

from .stage import Stage, stage_of

SIZE = (120, 80)
PLACES = [
    pytest.param(1e-3, (0.0, 0.0, 0.0), id="a thousandth"),
    pytest.param(1.0, (0.0, 0.0, 0.0), id="as is"),
    pytest.param(1e4, (0.0, 0.0, 0.0), id="ten thousandfold"),
    pytest.param(1.0, (1e5, 10.0, -1e5), id="far away"),
    pytest.param(1.0, (98765.432, -999.1, 77.7), id="at an uneven place"),
]
FLOOR, BALL = 4.0, 1.0  # m: half the floor's side and the ball's radius, before scaling
Point = tuple[float, float, float]
TEXEL = 2 * FLOOR / MAP_SIZE  # m, before scaling: along the light the floor is no wider than along its sides
# Of the shadow map, straight up, under a sun at 45 degrees: the offsets along the normal and towards the sun, and the
# reach of the tent (glsl/shared/shade.glsl).
BOUND_TEXELS = 2.2 * np.sqrt(0.5) + 0.5 * np.sqrt(0.5) + 1.5


def scene(scale: float, by: tuple[float, ...], height: float | None = None) -> Scene:
    """A ball above a floor under a slanting sun; or a sheet at a height [m, before scaling] under one at 45 degrees. No
    other light.
    """
    light = np.array([-0.4, -1.0, -0.3] if height is None else [-1.0, -1.0, 0.0])
    sun = Light("sun", (1.0, 1.0, 1.0), 3.0, direction=tuple(light / np.linalg.norm(light)))
    at = np.array(by)
    floor = quad(
        tuple(scale * np.array([-FLOOR, 0, FLOOR]) + at), (2 * scale * FLOOR, 0, 0), (0, 0, -2 * scale * FLOOR)
    )
    if height is None:
        sphere = trimesh.creation.icosphere(subdivisions=5, radius=scale * BALL)
        points = sphere.vertices + at + [0, 1.5 * scale * BALL, 0]
        arrays = (points, sphere.vertices / (scale * BALL), 0 * points[:, :2], np.zeros((len(points), 4)))
        other = Mesh(*(np.asarray(a, np.float32) for a in arrays), np.asarray(sphere.faces, np.uint32), 0)
    else:
        lift = np.array([-1, height, 1])
        other = quad(tuple(scale * lift + at), (2 * scale, 0, 0), (0, 0, -2 * scale))
    return replace(scene_of([floor, other], lights=[sun]), environment=Environment((0, 0, 0), (0, 0, 0)))


def stage_at(
    ctx: moderngl.Context, made: Scene, scale: float, by: tuple[float, ...], eye: Point, target: Point
) -> Stage:
    eye, target = (tuple(scale * np.array(p) + by) for p in (eye, target))
    return stage_of(ctx, made, look_at(eye, target), lens__aperture=0.0, temporal__antialias=False)


def lit_share(stage: Stage, view: str) -> np.ndarray:
    """(h, w) light with shadows over light without, where there is any to lose."""
    lit, full = (
        stage.linear(view, SIZE, spp=1, settings=put(stage.settings, "shading.shadows", on)).mean(axis=2)
        for on in (True, False)
    )
    return np.divide(lit, full, out=np.ones_like(full), where=full > 0)


@pytest.mark.parametrize("view", ["sharp", "traced"])
@pytest.mark.parametrize(("scale", "by"), PLACES)
def test_the_side_towards_the_sun_is_never_in_shadow(
    ctx: moderngl.Context, scale: float, by: tuple[float, ...], view: str
) -> None:
    """Seen from the sun, a ball and a floor show only what it lights, up to the ball's outline on the floor."""
    stage = stage_at(ctx, scene(scale, by), scale, by, (2.4, 7.5, 1.8), (0.0, 1.5, 0.0))
    share = lit_share(stage, view)
    assert (share < 0.99).mean() < 2e-2, "an outline of a pixel or two"
    inside = share[SIZE[1] // 2 - 8 : SIZE[1] // 2 + 8, SIZE[0] // 2 - 8 : SIZE[0] // 2 + 8]  # of the ball
    assert (inside == 1.0).all()
    stage.renderer.scene.release()
    stage.renderer.release()


@pytest.mark.parametrize("view", ["sharp", "traced"])
@pytest.mark.parametrize(("scale", "by"), PLACES)
def test_what_is_just_above_a_surface_still_shadows_it(
    ctx: moderngl.Context, scale: float, by: tuple[float, ...], view: str
) -> None:
    """A sheet at twice the offsets, which are texels of the map and so scale with the scene, under a sun at 45 degrees:
    its shadow is a strip as wide as the sheet is high. Up the middle of the picture: floor, strip, and the sheet.
    """
    height = 2 * BOUND_TEXELS * TEXEL
    eye, target = (-1.5, 0.4, 0.0), (-1.0 - height, 0.0, 0.0)
    stage = stage_at(ctx, scene(scale, by, height), scale, by, eye, target)
    column = lit_share(stage, view)[:, SIZE[0] // 2]
    assert column[0] == column[-1] == 1.0
    slope = [(0.4 - y) / (x + 1.5) for x, y in ((-1.0 - height, 0.0), (-1.0, height))]  # from where the strip is seen
    tilt = np.arctan2(0.4, 0.5 - height)
    seen = np.tan(tilt - np.arctan(slope)) / (2 * np.tan(np.radians(45) / 2)) * SIZE[1]
    assert (column < 0.01).sum() > 0.5 * abs(seen[1] - seen[0])
    stage.renderer.scene.release()
    stage.renderer.release()
