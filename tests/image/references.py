"""Converged pictures of the stages, kept in out/references/ for as long as nothing they depend on changes.

They are the raster reference: it shares no visibility code with the rays it judges, and costs a fifth of the traced
view.
"""

from __future__ import annotations

from pathlib import Path

import moderngl

from app.camera import Moment
from app.measure import reference as made
from app.measure.reference import Reference

from .stage import Stage

FOLDER = Path(__file__).parents[2] / "out" / "references"


def reference(
    ctx: moderngl.Context,
    stage: Stage,
    scene: str,
    size: tuple[int, int],
    spp: int,
    moment: Moment | None = None,
) -> Reference:
    """The view of a stage at a moment (default: its camera, time 0), read from FOLDER or drawn and kept there.

    `scene` is a digest of the scene; `spp` is even.
    """
    camera, time_s = moment or Moment(stage.camera, 0.0)
    stage.renderer.resize(size)
    return made.reference(ctx, stage.renderer, camera, stage.settings, spp, scene=scene, time_s=time_s, folder=FOLDER)
