"""Scenes of no, one and two triangles, in every view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from app.camera import look_at
from app.frame.pipeline import VIEWS
from app.gpu.scene import GpuScene
from app.scene.flatten import flatten
from app.scene.model import Material, Scene
from tests.image.stage import stage_of

from .small_scenes import moving, quad, scene_of

SQUARE = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0))
SKY = (0.5, 0.6, 0.7)


def collapsed(scene: Scene) -> Scene:
    """Every instance scaled to a point: `flatten` leaves vertices, and no triangle."""
    return replace(scene, instances=tuple(replace(i, transform=np.diag([0.0, 0, 0, 1])) for i in scene.instances))


SCENES: dict[str, tuple[int, Callable[[], Scene]]] = {
    "nothing": (0, lambda: Scene((), (Material(),), ())),
    "a point": (0, lambda: collapsed(scene_of([SQUARE]))),
    "a moving point": (0, lambda: collapsed(moving(scene_of([SQUARE]), 0, slide=[(0, 0, 0), (1, 0, 0)]))),
    "one": (1, lambda: scene_of([replace(SQUARE, triangles=SQUARE.triangles[:1])])),
    "two": (2, lambda: scene_of([SQUARE])),
}


@pytest.mark.parametrize("name", SCENES)
def test_every_view_shows_them(ctx: moderngl.Context, name: str) -> None:
    """Share of the picture: what the projected triangles cover, to a pixel on each side; the rest is sky."""
    count, make = SCENES[name]
    stage = stage_of(
        ctx, make(), look_at((0, 0, 4), (0, 0, 0)), shading__mode="unlit", shading__background=list(SKY),
        lens__aperture=0.01, lens__focus_distance=4.0,
    )  # fmt: skip
    for view in VIEWS:
        picture = stage.linear(view, (48, 48), spp=4)
        assert np.isfinite(picture).all()
        covered = np.mean((picture - SKY) / (1.0 - np.array(SKY)))
        expected = count / 2 * (1 / (4 * np.tan(np.radians(22.5)))) ** 2
        assert covered == pytest.approx(expected, abs=0.03 if count else 1e-3)
    assert ctx.error == "GL_NO_ERROR"
    stage.renderer.scene.release()
    stage.renderer.release()


@pytest.mark.parametrize("textures", [False, True])
def test_records_of_nothing_can_be_held_either_way(ctx: moderngl.Context, textures: bool) -> None:
    scene = SCENES["nothing"][1]()
    gpu = GpuScene(ctx, scene, flatten(scene), None, textures)
    assert gpu.triangle_count == 0
    gpu.release()
