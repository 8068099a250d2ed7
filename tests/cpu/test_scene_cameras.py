"""Cameras in glTF files that no picture can be taken with, or only just: dropped with a note, never a refused scene."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.camera import FARTHEST_M, FOV_Y_DEG, look_at
from app.scene.load import load_scene
from app.scene.model import Scene

from .gltf_maker import Maker


def scene_with_camera(tmp_path: Path, yfov: float = 0.7, extras: object = None, **node: object) -> Scene:
    maker = Maker()
    maker.triangle()
    camera = {"type": "perspective", "perspective": {"yfov": yfov, "znear": 0.1}, "name": "odd", "extras": extras}
    maker.node(camera=maker.add("cameras", camera), **node)
    return load_scene(str(maker.write(tmp_path / "scene.gltf")))


@pytest.mark.parametrize(
    ("yfov", "node"),
    [
        (1e-300, {}),
        (math.radians(FOV_Y_DEG[0]) * 0.99, {}),
        (math.radians(FOV_Y_DEG[1]) * 1.001, {}),
        (0.7, {"translation": [1.01 * FARTHEST_M, 0, 0]}),
        (0.7, {"translation": [0, 1e300, 0]}),
    ],
)
def test_a_camera_beyond_use_is_dropped_with_a_note(tmp_path: Path, yfov: float, node: dict[str, object]) -> None:
    scene = scene_with_camera(tmp_path, yfov, **node)
    assert scene.cameras == ()
    assert len(scene.meshes) == 1
    assert any("'odd'" in note and "left out" in note for note in scene.report.notes)


@pytest.mark.parametrize("focus", [None, 1e-300, 1e-13, 1e-3, 1e300])
@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
@pytest.mark.parametrize("out", [0.0, 1e8])
def test_a_camera_looks_its_way_whatever_its_scale_place_and_focus(
    tmp_path: Path, focus: float | None, scale: float, out: float
) -> None:
    extras = {"focus_distance": focus} if focus else {}
    (camera,) = scene_with_camera(tmp_path, extras=extras, scale=[scale] * 3, translation=[out, 0, 0]).cameras
    seen = look_at(camera.eye, camera.target, camera.up, camera.fov_y_deg)
    np.testing.assert_allclose(seen.forward, (0, 0, -1), atol=1e-15)
    assert camera.focus_distance == focus
