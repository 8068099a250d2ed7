"""Averages over thousands of frames neither drift nor lose light, and history goes where it must."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.camera import look_at
from app.frame.pipeline import VIEWS
from app.renderer import Renderer
from app.scene.model import Material
from app.settings import put

from ..gpu.small_scenes import quad, scene_of
from .stage import Stage, stage_of, untimed

SIZE = (32, 18)
CAMERA = look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
NEAR, MIDDLE, FAR = (0.8, 0.1, 0.1, 1.0), (0.9, 0.9, 0.2, 1.0), (0.1, 0.6, 0.1, 1.0)
NEAR_M, FOCUS_M, FAR_M = 1.0, 3.0, 6.0
LENS = {"lens__aperture": 1.0, "lens__focus_distance": FOCUS_M, "shading__mode": "unlit"}
ULP = 2.0**-24  # half the spacing of float32 numbers, as a part of them


def layers(ctx: moderngl.Context, edge: float = 0.0) -> Stage:
    """A near sheet that covers the picture left of `edge` [m], something small in focus, and a wall."""
    sheet = quad((-50.0, -50.0, -NEAR_M), (50.0 + edge, 0, 0), (0, 100.0, 0), 0)
    stand = quad((0.2, -0.5, -FOCUS_M), (0.5, 0, 0), (0, 1.0, 0), 1)
    wall = quad((-50.0, -50.0, -FAR_M), (100.0, 0, 0), (0, 100.0, 0), 2)
    return stage_of(
        ctx, scene_of([sheet, stand, wall], [Material(NEAR), Material(MIDDLE), Material(FAR)]), CAMERA, **LENS
    )


@pytest.mark.parametrize("view", ["sharp", "post", "hybrid"])
def test_the_mean_of_thousands_of_frames_is_their_mean(ctx: moderngl.Context, soak: bool, view: str) -> None:
    """What is shown after n frames against the frames themselves, added up in float64."""
    stage, frames = layers(ctx), 10_000 if soak else 300
    renderer, total = stage.renderer, np.zeros((SIZE[1], SIZE[0], 3))
    renderer.resize(SIZE)
    renderer.reset()
    for _ in range(frames):
        renderer.draw(view, stage.camera, stage.settings)
        assert renderer.plan is not None
        total += renderer.read({"sharp": "lit"}.get(view, view))[..., :3]
    shown, mean = renderer.read("resolved")[..., :3].astype(float), total / frames
    # An update errs by two roundings of numbers up to the mean, its sum with the earlier ones by k / n of theirs.
    assert np.abs(shown - mean).max() < frames * ULP * np.abs(total).max() / frames + 4 * ULP
    assert abs(shown.sum() / mean.sum() - 1.0) < 1e-3


def test_layers_of_ten_thousand_frames_hold_all_light(ctx: moderngl.Context, soak: bool) -> None:
    """Shares of near and far add to one, in a picture whose brightness is that of its first thousand rays."""
    stage, frames = layers(ctx), 10_000 if soak else 400
    energy, settings = {}, put(stage.settings, "mask.settle", False)
    for count in (frames // 10, frames):
        renderer = stage.draw("hybrid", SIZE, frames=count, settings=settings)
        held = renderer.read("layer_state")[..., 3] > 0.0
        shares = renderer.read("near_layer")[..., 3] + renderer.read("far_layer")[..., 3]
        assert np.abs(shares[held] - 1.0).max() < 1e-3
        rays = renderer.read("layer_state")[..., 0][held]
        assert rays.mean() > 2 * count, "rays went on"
        energy[count] = renderer.linear().astype(float).sum()
    assert abs(energy[frames] / energy[frames // 10] - 1.0) < 1e-3


@pytest.mark.parametrize(("edge", "ratio"), [(50.0, 1.0), (-40.0, 0.0)], ids=["all near", "all far"])
def test_a_picture_of_one_layer_is_that_layer(ctx: moderngl.Context, edge: float, ratio: float) -> None:
    """Rays everywhere, though one layer is never hit: 0/0 in its mean, and nothing of it in the picture."""
    stage = layers(ctx, edge)
    stage.renderer.every_effect = True  # with the sheet out of view, rays would be left out
    settings = put(put(stage.settings, "mask.edges", False), "blend.raster", False)
    renderer = stage.draw("hybrid", SIZE, frames=4, settings=settings)
    assert np.isfinite(renderer.linear()).all()
    assert (renderer.read("layer_state")[..., 2] == ratio).all()
    held = renderer.read("near_layer" if ratio else "far_layer")
    other = renderer.read("far_layer" if ratio else "near_layer")
    assert np.abs(held[..., 3] - 1.0).max() < 8 * ULP
    assert not other.any()
    if ratio:  # the wall of one colour that fills the picture: post-process and rays show nothing else
        np.testing.assert_allclose(
            renderer.linear(), np.broadcast_to(NEAR[:3], renderer.linear().shape), rtol=4 * 2**-11
        )


def used(view: str, what: str, stage: Stage, other: Stage) -> Renderer:
    """A renderer that has accumulated frames of a view which differ in one thing from what it shall draw next."""
    settings, size, camera = stage.settings, SIZE, stage.camera
    if what == "aperture":
        settings = put(settings, "lens.aperture", 0.6)
    if what == "focus":
        settings = put(settings, "lens.focus_distance", 5.0)
    if what == "size":
        size = (20, 44)
    if what == "cut":
        camera = look_at((3.0, 0.0, 0.0), (9.0, 0.0, 4.0))
    renderer = untimed(stage.renderer._ctx, (other if what == "scene" else stage).renderer.scene)
    renderer.resize(size)
    for _ in range(3):
        renderer.draw(view, camera, settings)
    renderer.scene = stage.renderer.scene
    renderer.resize(SIZE)
    return renderer


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("what", ["aperture", "focus", "size", "cut", "scene"])
def test_nothing_of_the_past_survives_a_change(ctx: moderngl.Context, what: str, view: str) -> None:
    """Every target, bit by bit, as from a renderer that has drawn nothing before."""
    stage, other = layers(ctx), layers(ctx, edge=0.3)
    renderer, fresh = used(view, what, stage, other), untimed(ctx, stage.renderer.scene)
    fresh.resize(SIZE)
    for _ in range(2):
        for one in (renderer, fresh):
            one.draw(view, stage.camera, stage.settings)
        assert renderer.plan is not None
        assert fresh.plan is not None
        assert renderer.plan.targets == fresh.plan.targets
        for target in renderer.plan.targets:
            ours, theirs = renderer.read(target), fresh.read(target)
            if target.startswith("trace_"):  # which only pixels with rays write, and are read for
                ours, theirs = (x[fresh.read("ray_count")[..., 0] > 0.0] for x in (ours, theirs))
            np.testing.assert_array_equal(ours, theirs, err_msg=target)
    for one in (renderer, fresh):
        one.release()
