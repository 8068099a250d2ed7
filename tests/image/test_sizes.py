"""Pictures of every size: from one pixel to 8K, grown and shrunk on the way, and the same bytes each time."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from app.camera import Moment
from app.cli import main
from app.errors import BAD_INPUT, UserError
from app.frame.pipeline import VIEWS
from app.frame.targets import TILE_PX
from app.gpu import memory
from app.measure.metrics import mean_flip
from app.scene.model import Material

from ..gpu.small_scenes import quad, scene_of
from .stage import Stage, opened, stage_of, untimed
from .test_stress import sound

ROOT = Path(__file__).parents[2]
SIZES = (
    (1, 1), (1, 97), (97, 1), (2, 2), (97, 53),
    (TILE_PX - 1, 2 * TILE_PX + 1), (TILE_PX + 1, 2 * TILE_PX - 1),
)  # fmt: skip
HUGE = (7680, 4320)


@pytest.fixture(scope="module")
def stage(ctx: moderngl.Context) -> Stage:
    """Textures, a sun, a lamp, near and far blur: what a picture of some size calls for is every pass."""
    return opened(ctx, "stress:twin")


@pytest.fixture
def whole(stage: Stage) -> Iterator[Stage]:
    """The same with every pass, also where a picture is too small for its blur."""
    stage.renderer.every_effect = True
    yield stage
    stage.renderer.every_effect = False


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_every_size_draws_still_and_moving(whole: Stage, view: str, size: tuple[int, int]) -> None:
    cameras = [whole.camera, whole.camera, whole.camera.moved(0.02, 0.01, -0.02), whole.camera.moved(0.04, 0.02, -0.02)]
    for number, renderer in enumerate(whole.frames(view, size, [Moment(camera, 0.0) for camera in cameras])):
        sound(renderer, f"{view}, frame {number}")
        assert renderer.picture().shape == (size[1], size[0], 3)
        assert renderer.linear().min() > 0.0


@pytest.mark.parametrize("view", VIEWS)
def test_one_pixel_holds_the_mean_of_the_picture(stage: Stage, view: str) -> None:
    """A pixel is the mean of what lies in it, at any size, and one of them is all of the picture."""
    one = stage.linear(view, (1, 1), frames=256, spp=256)[0, 0]
    many = stage.linear("traced", (32, 32), spp=32)
    # Independent samples would know the mean to deviation / sqrt(256); sequences that avoid themselves do better.
    np.testing.assert_allclose(one, many.mean((0, 1)), atol=4 * float(many.std()) / 16)


@pytest.mark.parametrize("view", VIEWS)
def test_a_resized_renderer_draws_as_a_new_one_does(ctx: moderngl.Context, stage: Stage, view: str) -> None:
    """Smaller, larger and back, in the middle of accumulating: bit for bit, in every target of the frame."""
    renderer = untimed(ctx, stage.renderer.scene)
    renderer.seed = 5
    for size in ((64, 36), (97, 53), (20, 50), (64, 36)):
        renderer.resize(size)
        new = untimed(ctx, stage.renderer.scene)
        new.resize(size)
        new.seed = 5
        for frame in range(3):
            camera = stage.camera.moved(0.01 * frame, 0.0, 0.0) if frame == 2 else stage.camera
            for drawn in (renderer, new):
                drawn.draw(view, camera, stage.settings)
        assert renderer.plan is not None
        assert new.plan is not None
        assert renderer.plan.targets == new.plan.targets
        for target in renderer.plan.targets:
            assert renderer.read(target).tobytes() == new.read(target).tobytes(), f"{target} at {size}"
        new.release()
    renderer.release()


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("focus_distance", [1e-3, 1e6])
def test_an_even_wall_stays_even_under_blur_larger_than_the_picture(
    ctx: moderngl.Context, view: str, focus_distance: float
) -> None:
    """Each pixel's circle of confusion covers every tile: light is moved about, none is made, lost or let in."""
    color = (0.75, 0.375, 0.1875)
    wall = quad((-4000, -4000, -2), (8000, 0, 0), (0, 8000, 0))  # rays from the lens' rim pass the focus at 45 degrees
    scene = scene_of([wall], [Material((*color, 1.0))])
    lens = {"lens__aperture": 1.0, "lens__focus_distance": focus_distance, "post__max_coc": 0.3, "post__rings": 8}
    stage = stage_of(ctx, scene, opened(ctx, "stress:empty").camera, shading__mode="unlit", **lens)
    size = (97, 53)
    picture = stage.linear(view, size, frames=4, spp=4)
    if view == "post":
        assert np.abs(stage.renderer.read("coc")).min() > (size[0] if focus_distance < 1.0 else 0.25 * size[1])
    # Sums of rings' shares, normalised, in half floats: a few of their steps, 2^-11.
    np.testing.assert_allclose(picture, np.broadcast_to(color, picture.shape), rtol=4 * 2.0**-11)
    stage.renderer.release()


SHOTS = """
import sys
from app.cli import main
folder, scenes, views = sys.argv[1], sys.argv[2].split(","), sys.argv[3].split(",")
for scene in scenes:
    for view in views:
        for suffix in ("png", "exr"):
            name = f"{folder}/{scene.replace(':', '-')}-{view}.{suffix}"
            picture = ["shot", scene, "-o", name, "--view", view, "--size", "97x53", "--frames", "3", "--spp", "3"]
            assert main([*picture, "--seed", "11", "--report", f"{name}.json"]) == 0
"""
TIMES = ("seconds", "frame_ms", "pass_ms", "timing_source")  # of a report: what may differ


def test_two_processes_write_the_same_bytes(tmp_path: Path, soak: bool) -> None:
    """Pictures and reports, in both formats; the second process draws the views the other way round."""
    scenes = ["still-life", "toy-train", "stress:twin", "stress:bright"] if soak else ["stress:twin"]
    runs = {}
    for name, views in (("a", [*VIEWS]), ("b", [*VIEWS][::-1])):
        (tmp_path / name).mkdir()
        arguments = [sys.executable, "-c", SHOTS, str(tmp_path / name), ",".join(scenes), ",".join(views)]
        runs[name] = subprocess.Popen(arguments, cwd=ROOT, stderr=subprocess.PIPE, text=True)
    for run in runs.values():
        _, errors = run.communicate()
        assert run.returncode == 0, errors
    files = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert files == sorted(path.name for path in (tmp_path / "b").iterdir())
    assert len(files) == len(scenes) * len(VIEWS) * 4
    for name in files:
        first, second = ((tmp_path / run / name).read_bytes() for run in "ab")
        if name.endswith(".json"):
            first, second = (
                {key: value for key, value in json.loads(text).items() if key not in TIMES} for text in (first, second)
            )
        assert first == second, name


def test_a_picture_beyond_what_the_device_has_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ctx: moderngl.Context
) -> None:
    monkeypatch.setattr("app.gpu.context.headless_context", lambda: ctx)  # one context a session
    side = ctx.info["GL_MAX_TEXTURE_SIZE"]
    for size in (f"{side + 1}x1", f"1x{side + 1}", f"{10**9}x{10**9}"):
        arguments = ["shot", "stress:one-triangle", "-o", str(tmp_path / "a.png"), "--size", size]
        assert main(arguments) == BAD_INPUT
        (line,) = capsys.readouterr().err.splitlines()
        assert f"--size {size}" in line
    assert not list(tmp_path.iterdir())


def test_a_picture_beyond_the_free_memory_is_refused_and_a_smaller_one_drawn(
    whole: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asked again whenever size or view change; what was drawn before is no longer asked for."""
    renderer = whole.draw("post", (40, 30))
    free = tmp_path / "meminfo"
    free.write_text("MemAvailable: 1024 kB\n")
    monkeypatch.setattr(memory, "MEMORY_FILE", free)
    monkeypatch.setattr(memory, "is_software", lambda ctx: True)
    for size in ((640, 360), (4000, 30)):  # higher, where blur is larger; only wider, where nothing else tells
        with pytest.raises(UserError, match=f"--size {size[0]}x{size[1]} needs"):
            whole.draw("post", size)
    assert "lit" not in renderer.memory
    whole.draw("post", (40, 30))
    free.write_text("MemAvailable: 0 kB\n")
    whole.draw("post", (40, 30))  # all there
    with pytest.raises(UserError, match="--size 40x30 needs"):
        whole.draw("hybrid", (40, 30))
    whole.draw("post", (40, 30))


def test_8k_draws_what_a_small_picture_shows(
    ctx: moderngl.Context, soak: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two views at 7680x4320, each pixel of the small picture the mean of 16x16; how long and how large is printed."""
    if not soak:
        pytest.skip("takes gigabytes and minutes: make soak")
    stage = opened(ctx, "still-life")
    for view in ("sharp", "post"):
        small = stage.linear(view, (480, 270), frames=16)
        begin = time.perf_counter()
        picture = stage.linear(view, HUGE, frames=1)
        seconds = time.perf_counter() - begin
        size = sum(stage.renderer.memory.values())
        assert np.isfinite(picture).all()
        flip = mean_flip(picture.reshape(270, 16, 480, 16, 3).mean((1, 3)), small)
        with capsys.disabled():
            print(
                f"\n{view} at 8K: first frame in {seconds:.1f} s, {size / 2**30:.2f} GiB; FLIP to 480x270: {flip:.4f}"
            )
        assert flip < 0.1  # textures are read at another level: a wrong or missing part of the picture is more
        stage.renderer.resize((8, 8))


ONE_PICTURE = 0.02  # FLIP that two resolutions may differ by beyond what the truth does


@pytest.mark.parametrize("scene", ["stress:twin", "still-life", "toy-train"])
def test_a_picture_is_the_same_at_twice_the_resolution(ctx: moderngl.Context, soak: bool, scene: str) -> None:
    """The larger one's means of 2x2 px, beside the smaller; the truth differs as well, by texture detail and noise."""
    if not soak and scene != "stress:twin":
        pytest.skip("detail that only large pictures and many frames resolve: make soak")
    stage, (width, height) = opened(ctx, scene), (320, 180) if soak else (160, 90)
    lens_points, frames = (1024, 128) if soak else (128, 16)

    def apart(view: str, **effort: int) -> float:
        small = stage.linear(view, (width, height), **effort)
        large = stage.linear(view, (2 * width, 2 * height), **effort)
        return mean_flip(large.reshape(height, 2, width, 2, 3).mean((1, 3)), small)

    floor = apart("reference", spp=lens_points)
    found = {view: apart(view, frames=frames) for view in ("sharp", "post", "hybrid")}
    found["traced"] = apart("traced", spp=lens_points)
    print(f"{scene} at {width}x{height} and twice that: reference {floor:.4f}, {found}")
    assert max(found.values()) < floor + ONE_PICTURE, (floor, found)
