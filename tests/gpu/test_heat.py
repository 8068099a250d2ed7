"""The map of the error over the window's picture: drawn for a still view, gone with a moved one, never drawn twice."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from app.camera import Camera, look_at
from app.measure.metrics import squared_errors
from app.panel.colormap import sequential
from app.panel.model import Look
from app.settings import Settings, put
from app.window import heat as module
from app.window.heat import Heat
from app.window.stage import Stage

SIZE = (64, 36)
CAMERA = look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
LOOK = Look(view="sharp", settings=put(Settings(), "lens.aperture", 0.3))


@pytest.fixture
def stage(ctx: moderngl.Context, tmp_path: Path) -> Iterator[Stage]:
    (tmp_path / "wall.obj").write_text("v -9 -6 -8\nv 0 -6 -8\nv 0 6 -8\nv -9 6 -8\nf 1 2 3\nf 1 3 4\n")
    made = Stage(ctx, lambda text, fraction: None)
    made.load(str(tmp_path / "wall.obj"))
    yield made
    made.release()


def test_the_map_is_of_the_picture_that_stands_still(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "POINTS", 8)
    heat = Heat(stage)
    settings = LOOK.settings

    def aim(camera: Camera) -> None:
        stage.draw(LOOK, camera, SIZE)
        heat.aim(camera, settings, SIZE, 0.0)

    aim(CAMERA)
    side = stage.sides[0]
    assert heat.texture(side, settings) is None
    while heat.busy:
        assert not heat.shown(side, settings).ready
        heat.step()
    texture = heat.texture(side, settings)
    assert texture is not None
    assert heat.texture(side, settings) is texture
    shown = heat.shown(side, settings)
    assert shown.ready

    truth = heat._reference
    assert truth is not None
    error = np.sqrt(squared_errors(side.renderer.linear(), truth.picture)[2])
    painted = np.frombuffer(texture.read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)[::-1, :, :3]
    np.testing.assert_allclose(painted, 255 * sequential(error / shown.ends[1]), atol=1.0)
    assert painted.std() > 10, "the wall's edge is blurred in truth and sharp in the picture"

    aim(CAMERA)
    assert not heat.busy, "nothing has changed"
    stage.draw(LOOK, CAMERA.moved(0.5, 0.0, 0.0), SIZE)
    assert heat.texture(side, settings) is None
    assert not heat.shown(side, settings).ready
    aim(CAMERA.moved(0.5, 0.0, 0.0))
    assert heat.busy
    heat.release()
