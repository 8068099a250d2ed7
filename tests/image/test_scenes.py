"""Every scene beside the checkout, from each of its camera files, in every view: it is drawn, and nothing is broken."""

from __future__ import annotations

from pathlib import Path

import moderngl
import numpy as np
import pytest

from .stage import opened

SIZE = (96, 54)
VIEWS = ("sharp", "post", "hybrid", "traced")
SHOTS = (
    ("greywhite_room.glb", "greywhite_room.json"),
    ("greywhite_room.glb", "greywhite_room_plant.json"),
    ("modern_living_room_partial.glb", "modern_living_room_partial.json"),
    ("flight_helmet/FlightHelmet.gltf", None),
)


@pytest.mark.parametrize(("scene", "camera"), SHOTS, ids=lambda name: Path(name).stem if name else "framed")
def test_real_scene_draws_in_every_view(
    ctx: moderngl.Context, shared_scenes: Path, scene: str, camera: str | None
) -> None:
    stage = opened(
        ctx, str(shared_scenes / scene), shared_scenes / camera if camera else None, unlit=camera is not None
    )
    pictures = {}
    for view in VIEWS:
        renderer = stage.draw(view, SIZE, frames=2)
        pictures[view] = renderer.linear()
        assert ctx.error == "GL_NO_ERROR", view
        assert np.isfinite(pictures[view]).all(), view
        assert renderer.picture().std() > 8, f"{view} is one colour"
    for view, picture in pictures.items():  # blur moves light about, but the room stays as bright
        np.testing.assert_allclose(picture.mean((0, 1)), pictures["sharp"].mean((0, 1)), rtol=0.2, err_msg=view)
