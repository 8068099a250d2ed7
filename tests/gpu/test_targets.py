"""GPU storage by name: sizes at odd resolutions, history, clears, what a frame costs in bytes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import UserError
from app.frame.lifetimes import lifetimes, own_slots, shared_slots
from app.frame.memory import buffer_bytes, scaled, texels
from app.frame.plan import plan
from app.frame.records import Pass
from app.frame.targets import BUFFERS, TARGETS
from app.gpu import memory
from app.gpu.context import is_software
from app.gpu.targets import IDLE, Targets
from app.optics import SKY_DEPTH
from app.scene.facts import Facts
from app.settings import Settings

from .live_objects import live_objects

SIZES = [(1, 1), (3, 2), (17, 33), (160, 90), (161, 91)]
BYTES = {"f1": 1, "f2": 2, "f4": 4}

WRITES = Pass("writes", "", history=("scout",), writes=("scout",))
READS = Pass("reads", "", reads=("scout",), writes=("display",))
SHOWS = Pass("shows", "", writes=("display",))
MEANS = Pass("means", "", updates=("traced",))
LAST = Pass("last", "", reads=("traced",), history=("resolved",), writes=("resolved",))
DRAWS = Pass("draws", "", kind="raster", writes=("base_color", "depth"))
CHAIN = (
    Pass("1", "", writes=("half_color",)),
    Pass("2", "", reads=("half_color",), writes=("trace_near",)),
    Pass("3", "", reads=("trace_near",), writes=("far_blur",)),
    Pass("4", "", reads=("far_blur",), writes=("trace_far",)),
    Pass("5", "", reads=("trace_far",), writes=("near_blur",)),
)


@pytest.fixture
def targets(ctx: moderngl.Context) -> Iterator[Targets]:
    made = Targets(ctx, (161, 91))
    yield made
    made.release()


@given(w=st.integers(1, 20_000), h=st.integers(1, 20_000), scale=st.integers(1, 64))
def test_a_scaled_target_covers_every_pixel_and_no_more(w: int, h: int, scale: int) -> None:
    for full, part in zip((w, h), scaled((w, h), scale), strict=True):
        assert part * scale >= full > (part - 1) * scale


@pytest.mark.parametrize("name", TARGETS)
def test_every_target_has_its_shape_type_and_zeroes_at_every_size(ctx: moderngl.Context, name: str) -> None:
    target = TARGETS[name]
    for size in SIZES:
        targets = Targets(ctx, size)
        values = targets.read(name)
        width, height = texels(target, size)
        assert values.shape == (height, width, target.components)
        assert values.dtype == {"f1": np.uint8, "f2": np.float16, "f4": np.float32}[target.dtype]
        assert not values.any()
        assert targets.bytes == {name: values.nbytes}
        targets.release()
        assert targets.bytes == {}


def test_texels_come_back_in_their_place(targets: Targets) -> None:
    """Odd rows of 2-byte texels: no padding is mistaken for data."""
    for name in ("mask", "motion", "lit", "display", "depth"):
        like = targets.read(name)
        values = (np.arange(like.size).reshape(like.shape) % 199).astype(like.dtype)
        targets.texture(name).write(values.tobytes(), alignment=1)
        assert (targets.read(name) == values).all()


def test_textures_clamp_and_filter_as_the_table_says(targets: Targets) -> None:
    for name, target in TARGETS.items():
        texture = targets.texture(name)
        assert not texture.repeat_x
        assert not texture.repeat_y
        expected = moderngl.LINEAR if target.filter == "linear" else moderngl.NEAREST
        assert texture.filter == (expected, expected)


def test_history_is_last_frames_value(targets: Targets) -> None:
    current, previous = targets.texture("resolved"), targets.texture("resolved", previous=True)
    assert current.glo != previous.glo
    for frame in range(3):
        value = np.full(targets.read("resolved").shape, frame, np.float32)
        targets.texture("resolved").write(value.tobytes())
        targets.swap("resolved")
        assert (targets.read("resolved", previous=True) == frame).all()
    assert targets.bytes["resolved"] == 2 * 161 * 91 * 16


def test_resizing_drops_everything(targets: Targets) -> None:
    targets.texture("lit"), targets.buffer("RayWork"), targets.framebuffer(("base_color", "depth"))
    targets.resize((40, 30))
    assert targets.bytes == {}
    assert targets.texture("lit").size == (40, 30)
    assert (targets.framebuffer(("base_color", "depth")).size) == (40, 30)


@pytest.mark.parametrize("size", [(0, 5), (5, 0), (-1, 5), (10**6, 5), (5, 10**6)])
def test_an_impossible_size_is_one_sentence(ctx: moderngl.Context, targets: Targets, size: tuple[int, int]) -> None:
    for attempt in (lambda: Targets(ctx, size), lambda: targets.resize(size)):
        with pytest.raises(UserError, match="--size") as caught:
            attempt()
        assert "\n" not in str(caught.value)
    assert targets.size == (161, 91), "a refused size changes nothing"


def test_a_framebuffer_begins_black_and_as_far_as_the_sky(targets: Targets) -> None:
    names = ("base_color", "normal", "depth")
    for _ in range(2):  # the second time over what the first left behind
        framebuffer = targets.framebuffer(names)
        assert framebuffer.size == (161, 91)
        assert not targets.read("base_color").any()
        assert (targets.read("depth") == np.float32(SKY_DEPTH)).all()
        for name in names:
            texture = targets.texture(name)
            texture.write(
                np.full(texture.size[0] * texture.size[1] * texture.components, 7, f"<{texture.dtype}").tobytes()
            )
    assert targets.bytes["depth test"] == 161 * 91 * 4


def test_the_depth_test_starts_anew_each_frame(ctx: moderngl.Context, targets: Targets) -> None:
    """What was drawn last frame hides nothing in this one."""
    program = ctx.program(
        vertex_shader="#version 430\nuniform float z; void main() { vec2 p = vec2(gl_VertexID & 1, gl_VertexID >> 1);"
        " gl_Position = vec4(4.0 * p - 1.0, z, 1.0); }",
        fragment_shader="#version 430\nuniform float z; out float out_depth; void main() { out_depth = z; }",
    )
    array = ctx.vertex_array(program, [])
    for z in (-0.5, 0.5):
        targets.framebuffer(("depth",)).use()
        ctx.enable_only(moderngl.DEPTH_TEST)
        program["z"] = z
        array.render(moderngl.TRIANGLES, vertices=3)
        assert (targets.read("depth") == z).all()
    array.release()
    program.release()


def test_clear_zeroes_one_target(targets: Targets) -> None:
    for name in ("traced", "traced_error"):
        targets.texture(name).write(np.ones(targets.read(name).size, np.float32).tobytes())
    targets.clear("traced")
    assert not targets.read("traced").any()
    assert (targets.read("traced_error") == 1.0).all()


def test_blocks_are_large_enough_and_begin_with_an_empty_dispatch(targets: Targets) -> None:
    for name, buffer in BUFFERS.items():
        width, height = scaled((161, 91), buffer.scale)
        assert (
            targets.buffer(name).size
            == buffer_bytes(buffer, (161, 91))
            == buffer.header + buffer.bytes_per_pixel * width * height
        )
        targets.buffer(name).write(b"\xff" * buffer.header)
        targets.begin_buffer(name)
        header = np.frombuffer(targets.buffer(name).read(buffer.header), "<u4")
        assert header[0] == 0, "nothing counted yet"
        if buffer.bytes_per_pixel:
            assert header[:3].tolist() == [0, 1, 1], "no work groups yet"


@pytest.mark.parametrize("dtype", BYTES)
def test_memory_is_counted_per_component(ctx: moderngl.Context, dtype: str) -> None:
    name = next(t.name for t in TARGETS.values() if t.dtype == dtype and t.scale == 1)
    targets = Targets(ctx, (10, 10))
    targets.texture(name)
    assert targets.bytes[name] == 100 * TARGETS[name].components * BYTES[dtype]
    targets.release()


LAYERS = own_slots(lifetimes(plan((WRITES, READS), "display", Settings(), Facts(0.0, 0.0)), ("display",)))
ELSEWHERE = own_slots(lifetimes(plan((SHOWS,), "display", Settings(), Facts(0.0, 0.0)), ("display",)))


def test_a_value_stays_from_frame_to_frame_and_is_dropped_with_its_plan(targets: Targets) -> None:
    for frame in range(3):
        targets.begin(LAYERS, ())
        expected = frame * np.ones_like(targets.read("scout"))  # zeroes at first
        assert (targets.read("scout", previous=True) == expected).all()
        targets.texture("scout").write((expected + 1.0).astype("f4").tobytes())
        targets.swap("scout")
    targets.begin(ELSEWHERE, ())
    assert targets.bytes.keys() == {"display", IDLE}
    targets.begin(LAYERS, ())
    assert IDLE not in targets.bytes
    assert not targets.read("scout", previous=True).any(), "what is older than a frame is nobody's history"


def test_a_forgotten_mean_begins_as_zeroes(targets: Targets) -> None:
    means = own_slots(lifetimes(plan((MEANS,), "traced", Settings(), Facts(0.0, 0.0)), ("traced",)))
    for expected in (0.0, 1.0, 0.0):
        targets.begin(means, ())
        assert (targets.read("traced") == expected).all()
        targets.texture("traced").write(np.ones(targets.read("traced").size, "f4").tobytes())
        if expected:
            targets.forget(("traced",))


def test_a_texture_is_filtered_as_whoever_it_holds_wants_it(targets: Targets) -> None:
    lives = lifetimes(plan(CHAIN, "near_blur", Settings(), Facts(0.0, 0.0)), ("near_blur",))
    targets.begin(shared_slots(lives), ())
    linear, nearest, last = (targets.texture(name) for name in ("half_color", "trace_near", "near_blur"))
    assert linear is last
    assert linear.filter == (moderngl.LINEAR, moderngl.LINEAR)
    assert nearest.filter == (moderngl.NEAREST, moderngl.NEAREST)
    assert targets.texture("trace_far") is nearest
    assert targets.texture("near_blur").filter == (moderngl.LINEAR, moderngl.LINEAR)


def test_a_framebuffer_does_not_outlive_its_textures(
    ctx: moderngl.Context, targets: Targets, monkeypatch: pytest.MonkeyPatch
) -> None:
    """GL gives a released texture's name to the next: a framebuffer found by that name would be over the old one."""
    monkeypatch.setattr("app.gpu.pool.IDLE_FRAMES", 0)
    for _ in range(4):
        targets.begin(own_slots(lifetimes(plan((DRAWS,), "depth", Settings(), Facts(0.0, 0.0)), ())), ())
        targets.framebuffer(("base_color", "depth")).use()
        assert (targets.read("depth") == np.float32(SKY_DEPTH)).all()
        targets.forget(("depth",))
        targets.begin(ELSEWHERE, ())  # which uses neither
        targets.texture("base_color")  # of another texture, maybe under the same name
        targets.clear("base_color")
        assert not targets.read("base_color").any()
        assert ctx.error == "GL_NO_ERROR"


def test_blocks_wait_and_go_like_textures(targets: Targets, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.gpu.targets.IDLE_FRAMES", 2)
    targets.begin((), ("RayWork",))
    block = targets.buffer("RayWork")
    for _ in range(2):
        targets.begin((), ())
        assert "RayWork" in targets.bytes
    targets.begin((), ("RayWork",))
    assert targets.buffer("RayWork") is block
    for _ in range(3):
        targets.begin((), ())
    assert targets.bytes == {}


def test_a_frame_beyond_the_free_memory_is_refused_before_anything_is_made(
    ctx: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = plan((MEANS, LAST), "resolved", Settings(), Facts(0.0, 0.0))
    slots = own_slots(lifetimes(frame, ("resolved",)))
    needed = 64 * 32 * (16 + 2 * 16) + buffer_bytes(BUFFERS["RayWork"], (64, 32))
    free = tmp_path / "meminfo"
    monkeypatch.setattr(memory, "MEMORY_FILE", free)
    monkeypatch.setattr(memory, "is_software", lambda ctx: True)
    targets = Targets(ctx, (64, 32))
    for text in ("", "MemAvailable:", "MemAvailable: much kB", "MemTotal: 1 kB"):
        free.write_text(text)
        targets.reserve(slots, ("RayWork",))  # not known: tried
    free.write_text(f"MemTotal: 99999999 kB\nMemAvailable:   {needed * 10 // 9 // 1024 + 1} kB\n")
    targets.reserve(slots, ("RayWork",))
    free.write_text(f"MemTotal: 99999999 kB\nMemAvailable:   {needed * 10 // 9 // 1024 - 1} kB\n")
    with pytest.raises(UserError, match="--size 64x32 needs"):
        targets.reserve(slots, ("RayWork",))
    assert targets.bytes == {}
    targets.texture("traced")  # what is there needs no more
    targets.reserve(slots, ("RayWork",))
    targets.begin(slots, ("RayWork",))
    free.write_text("MemAvailable: 0 kB\n")
    targets.reserve(slots, ("RayWork",))
    targets.begin(ELSEWHERE, ())
    targets.reserve(slots, ("RayWork",))  # it waits unused
    both = (*slots, *LAYERS)
    with pytest.raises(UserError, match="--size 64x32 needs"):
        targets.reserve(both, ("RayWork",))
    assert targets.bytes.keys() == {"display", "RayWork"}, "what waited made room"
    targets.release()


def test_a_texture_that_the_driver_cannot_make_is_a_sentence(ctx: moderngl.Context) -> None:
    """OpenGL says so by an error alone, and the picture would stay black."""
    if not is_software(ctx):
        pytest.skip("this device may have room for the largest texture it can address")
    side = ctx.info["GL_MAX_TEXTURE_SIZE"]
    targets = Targets(ctx, (side, side))
    with pytest.raises(
        UserError, match=f"--size {side}x{side} leaves no memory on this device for the target 'traced'"
    ):
        targets.texture("traced")
    assert targets.bytes == {}
    targets.release()


def test_framebuffers_that_share_a_depth_target_leave_nothing_behind(ctx: moderngl.Context) -> None:
    """Which targets a raster pass writes hangs on the scene: another set of them is another framebuffer."""
    before = live_objects(ctx)
    targets = Targets(ctx, (16, 9))
    for names in (("base_color", "depth"), ("base_color", "normal", "depth"), ("base_color", "depth")):
        targets.framebuffer(names)
    targets.release()
    assert live_objects(ctx) == before
