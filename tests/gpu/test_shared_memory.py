"""Targets that share textures: the same pictures bit for bit, nothing read that was not written, memory given back."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from app.camera import Camera
from app.errors import UserError
from app.frame.lifetimes import PICKED
from app.frame.memory import frame_memory
from app.frame.pipeline import VIEWS
from app.frame.records import Call
from app.frame.targets import TARGETS
from app.gpu.frame_block import FrameInputs
from app.gpu.targets import IDLE, Overwritten
from app.gpu.timing import WALL_CLOCK
from app.optics import SKY_DEPTH
from app.renderer import Renderer
from app.settings import Settings, from_dict, put

from ..image.stage import Stage, opened

SIZE = (67, 41)  # no multiple of a work group, a tile or two
SHORT = 5  # frames that unused textures wait here
VARIATIONS: dict[str, dict[str, object]] = {
    "as the scene has it": {},
    "unlit, without anti-aliasing": {"shading.mode": "unlit", "temporal.antialias": False},
    "rays everywhere": {"mask.edges": False, "reconstruct.spatial": False},
    "no gradients, focus plane": {"reconstruct.gradients": False, "overlay.focus_plane": True},
}
CASES = (  # of scenes, the second of which moves
    ("still-life", "as the scene has it"),
    ("still-life", "rays everywhere"),
    ("toy-train", "unlit, without anti-aliasing"),
    ("toy-train", "no gradients, focus plane"),
)


class PoisonedBefore(Renderer):
    """Draws as any, except that each target is filled with what no pass should read right before it is written."""

    def _run(self, call: Call, inputs: FrameInputs) -> None:
        for name in {*call.writes} - {*call.step.updates, *call.in_place}:
            texture = self._targets.texture(name)
            count = texture.width * texture.height * texture.components
            bad = {"f1": np.uint8(255), "f2": np.float16(np.nan), "f4": np.float32(np.nan)}[TARGETS[name].dtype]
            texture.write(np.full(count, bad).tobytes())
        super()._run(call, inputs)


def renderer_of(stage: Stage, share: bool = True, kind: type[Renderer] = Renderer) -> Renderer:
    made = kind(stage.renderer._ctx, stage.renderer.scene, SIZE, seed=3, timing_source=WALL_CLOCK, share_memory=share)
    made.profiler.enabled = False
    return made


def varied(stage: Stage, name: str) -> Settings:
    return from_dict(VARIATIONS[name], wide(stage))


def wide(stage: Stage) -> Settings:
    """So that so small a picture has blur that calls for rays."""
    return put(stage.settings, "lens.aperture", 0.3)


def frames(camera: Camera, step: int) -> Iterator[tuple[Camera, float]]:
    """Still, still, moving, still: camera and time [s]."""
    for k in (0, 0, 1, 1):
        yield camera.moved(0.02 * (step + k), 0.0, -0.01 * k), 0.1 * (step + k)


def own_bytes(renderer: Renderer) -> dict[str, int]:
    return {name: count for name, count in renderer.memory.items() if not name.startswith("scene: ")}


@pytest.mark.parametrize(("scene", "variation"), CASES)
def test_pictures_are_the_same_bit_for_bit(ctx: moderngl.Context, scene: str, variation: str) -> None:
    """In every view and some targets, one after the other, each from still to moving and back: what one leaves in its
    textures is nothing to the next.
    """
    stage = opened(ctx, scene)
    settings = varied(stage, variation)
    alone, sharing = renderer_of(stage, share=False), renderer_of(stage)
    order = ("hybrid", "trace_near", "traced", "sharp", "near_gather", "reference", "hybrid", "post")
    for step, view in enumerate(order):
        for camera, time_s in frames(stage.camera, step):
            for renderer in (alone, sharing):
                renderer.draw(view, camera, settings, time_s=time_s)
            assert sharing.picture().tobytes() == alone.picture().tobytes(), view
            assert sharing.linear().tobytes() == alone.linear().tobytes(), view
            if PICKED in sharing.plan.targets:
                assert sharing.read(PICKED).tobytes() == alone.read(PICKED).tobytes()
    for renderer in (alone, sharing):
        renderer.release()


def test_slices_find_what_the_first_one_drew(ctx: moderngl.Context) -> None:
    """The raster image that stands in for pixels without a sample, and the CoC under the focus plane."""
    stage = opened(ctx, "still-life")
    settings = put(stage.settings, "overlay.focus_plane", True)
    alone, sharing = renderer_of(stage, share=False), renderer_of(stage)
    for renderer in (alone, sharing):
        renderer.draw("hybrid", stage.camera, settings)
    for _ in range(8):
        for renderer in (alone, sharing):
            renderer.draw("traced", stage.camera, settings, time_budget_ms=1e-3)  # so little that rows come in eights
        assert sharing.picture().tobytes() == alone.picture().tobytes()
        assert sharing.depth_at(30, 20) == alone.depth_at(30, 20)
    assert sharing.converged_samples == 1
    for renderer in (alone, sharing):
        renderer.release()


@pytest.mark.parametrize(("scene", "variation"), CASES)
def test_no_pass_leaves_or_reads_a_texel_that_it_did_not_write(
    ctx: moderngl.Context, scene: str, variation: str
) -> None:
    """Whatever a texture held before: pictures stay as they are, and the health counter finds all of them in order."""
    stage = opened(ctx, scene)
    settings = varied(stage, variation)
    clean, poisoned = renderer_of(stage), renderer_of(stage, kind=PoisonedBefore)
    poisoned.health.watched = "all"
    for step, view in enumerate(("hybrid", "traced", "reference")):
        for camera, time_s in frames(stage.camera, step):
            for renderer in (clean, poisoned):
                renderer.draw(view, camera, settings, time_s=time_s)
            assert poisoned.picture().tobytes() == clean.picture().tobytes(), view
            found = poisoned.health.finish()
            assert found
            assert not {name: bad for name, bad in found.items() if bad}, view
    for renderer in (clean, poisoned):
        renderer.release()


@pytest.mark.parametrize("variation", ["as the scene has it", "rays everywhere"])
@pytest.mark.parametrize("view", [*VIEWS, "near_gather", "mask"])
def test_a_frame_takes_what_its_plan_says(ctx: moderngl.Context, view: str, variation: str) -> None:
    stage = opened(ctx, "toy-train")
    settings = varied(stage, variation)
    for share in (False, True):
        renderer = renderer_of(stage, share)
        for camera, time_s in list(frames(stage.camera, 0))[:3]:
            renderer.draw(view, camera, settings, time_s=time_s)
            memory = frame_memory(renderer.plan, SIZE)
            used = {name: count for name, count in own_bytes(renderer).items() if name != IDLE}
            assert sum(used.values()) == (memory.total if share else memory.unshared)
            assert {n for names in used for n in names.split(", ")} == memory.targets.keys() | memory.blocks.keys()
        renderer.release()


def settled(renderer: Renderer, view: str, stage: Stage, settings: Settings) -> dict[str, int]:
    """What a renderer holds once it has drawn a view for long."""
    for _ in range(SHORT + 2):
        renderer.draw(view, stage.camera, settings)
    return own_bytes(renderer)


@pytest.mark.parametrize("share", [False, True])
def test_what_a_view_leaves_behind_is_given_back(
    ctx: moderngl.Context, share: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A closed aperture makes hybrid sharp; sharp after hybrid and traced holds what a fresh one does."""
    monkeypatch.setattr("app.gpu.pool.IDLE_FRAMES", SHORT)
    monkeypatch.setattr("app.gpu.targets.IDLE_FRAMES", SHORT)
    stage = opened(ctx, "still-life")
    pinhole = put(stage.settings, "lens.aperture", 0.0)
    fresh, used = renderer_of(stage, share), renderer_of(stage, share)
    sharp = settled(fresh, "sharp", stage, stage.settings)
    used.draw("hybrid", stage.camera, stage.settings)
    before = sum(own_bytes(used).values())
    used.draw("hybrid", stage.camera, pinhole)
    assert own_bytes(used)[IDLE] > 0
    assert sum(own_bytes(used).values()) == before, "at first it is kept: the aperture may open again"
    assert settled(used, "hybrid", stage, pinhole) == sharp
    used.draw("traced", stage.camera, stage.settings)
    used.draw("post", stage.camera, stage.settings)
    assert settled(used, "sharp", stage, stage.settings) == sharp
    assert ctx.error == "GL_NO_ERROR"
    for renderer in (fresh, used):
        renderer.release()
        assert own_bytes(renderer) == {}


def test_switching_back_and_forth_allocates_nothing(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the picture returned is the renderer's one display texture."""
    stage = opened(ctx, "still-life")
    renderer = renderer_of(stage)
    for view in ("hybrid", "sharp", "post", "hybrid"):
        display = renderer.draw(view, stage.camera, stage.settings)
    before = renderer.memory
    made: list[object] = []
    pool = type(renderer._targets._pool)
    make = pool._make
    monkeypatch.setattr(pool, "_make", lambda *arguments: made.append(arguments) or make(*arguments))
    for _ in range(3):
        for view in ("sharp", "post", "hybrid"):
            assert renderer.draw(view, stage.camera, stage.settings) is display
    assert not made
    assert sum(renderer.memory.values()) == sum(before.values())
    renderer.release()


def test_a_target_that_was_overwritten_is_not_read_as_another(ctx: moderngl.Context) -> None:
    stage = opened(ctx, "still-life")
    alone, sharing = renderer_of(stage, share=False), renderer_of(stage)
    for renderer in (alone, sharing):
        for _ in range(2):
            renderer.draw("hybrid", stage.camera, wide(stage))
    gone = set()
    for name in sharing.plan.targets:
        try:
            values = sharing.read(name)
        except Overwritten:
            gone.add(name)
        else:
            assert values.tobytes() == alone.read(name).tobytes(), name
    with pytest.raises(Overwritten, match=r"^the target 'base_color' is gone: its texture holds '\w+' by now; [^\n]+$"):
        sharing.read("base_color")
    assert {"base_color", "half_color", "mask_guide", "trace_near"} <= gone
    assert not gone & {"display", "resolved", "depth", "near_layer", "ray_count"}
    sharing.draw("trace_near", stage.camera, wide(stage))
    alone.draw("trace_near", stage.camera, wide(stage))
    assert sharing.read("trace_near").tobytes() == alone.read("trace_near").tobytes(), "a view keeps its target"
    for renderer in (alone, sharing):
        renderer.release()


@pytest.mark.parametrize("view", VIEWS)
def test_the_depth_under_a_click_is_there_in_every_view_of_a_window(ctx: moderngl.Context, view: str) -> None:
    """The traced view draws a G-buffer for its first samples alone."""
    stage = opened(ctx, "still-life")
    renderer = renderer_of(stage)
    assert renderer.depth_at(33, 30) == 0.0, "nothing was drawn yet"
    renderer.draw("sharp", stage.camera, stage.settings)
    expected = renderer.depth_at(33, 30)
    assert 0.0 < expected < SKY_DEPTH
    for _ in range(8):
        renderer.draw(view, stage.camera, stage.settings, time_budget_ms=1e-3)
    for _ in range(2):
        renderer.draw(view, stage.camera, stage.settings, time_budget_ms=1e4)
    assert renderer.converged_samples > 1
    # antialiasing's shift within the pixel
    assert renderer.depth_at(33, 30) == pytest.approx(expected, rel=0.05)
    renderer.draw("kernel", stage.camera, stage.settings)
    assert renderer.depth_at(33, 30) == 0.0, "this view has no depth"
    renderer.release()


def test_a_refused_frame_leaves_the_renderer_as_it_was(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = opened(ctx, "still-life")
    renderer = renderer_of(stage)
    renderer.draw("sharp", stage.camera, stage.settings)
    before = renderer.picture()
    monkeypatch.setattr("app.gpu.memory.free_bytes", lambda ctx: 0)
    with pytest.raises(UserError, match="--size 67x41 needs"):
        renderer.draw("hybrid", stage.camera, stage.settings)
    assert renderer.picture().tobytes() == before.tobytes()
    renderer.draw("sharp", stage.camera, stage.settings)
    renderer.release()
