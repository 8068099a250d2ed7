"""From a scene's size to a viewpoint and settings: what is suggested stays within what the settings allow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.camera import FARTHEST_M, Camera, Viewpoint, read_viewpoint, write_viewpoint
from app.scene.validate import MAX_COORDINATE
from app.session import focused, framing
from app.settings import Lens, Settings


@pytest.mark.parametrize("extent", [0.0, 1e-6, 1.0, 300.0, 1e9])
def test_a_framed_scene_of_any_size_can_be_saved_and_read(extent: float, tmp_path: Path) -> None:
    view = framing(np.zeros(3), np.full(3, extent))
    lens = focused(Settings(), view).lens
    for name in ("focus_distance", "aperture"):
        allowed = Lens.__dataclass_fields__[name].metadata
        assert allowed["low"] <= getattr(lens, name) <= allowed["high"]
    write_viewpoint(tmp_path / "view.json", Viewpoint(view.camera, lens.focus_distance, lens.aperture))
    back = read_viewpoint(tmp_path / "view.json")
    assert (back.focus_distance, back.aperture) == (lens.focus_distance, lens.aperture)


def test_the_largest_scene_is_framed_from_within_the_world() -> None:
    corner = np.full(3, MAX_COORDINATE)
    assert max(map(abs, framing(-corner, corner).camera.eye)) < FARTHEST_M


def test_what_the_user_gives_wins_over_the_viewpoint_and_what_neither_gives_stays() -> None:
    view = Viewpoint(Camera(), focus_distance=3.0, aperture=0.1)
    lens = focused(Settings(), view, {"lens.aperture": 0.2}).lens
    assert (lens.focus_distance, lens.aperture) == (3.0, 0.2)
    assert focused(Settings(), Viewpoint(Camera())) == Settings()
