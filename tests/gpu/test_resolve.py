"""Temporal anti-aliasing: a running mean while still, clipped reprojection while moving, nothing unusable let in."""

from __future__ import annotations

import numpy as np
import pytest

from . import shading_twin as twin
from .harness import call_glsl
from .passes import run_pass

RESOLVE = "output/resolve.comp"
SIZE = (24, 40)  # h, w


def resolve(ctx, color, history, *, motion=None, valid=1, alpha=0.1) -> np.ndarray:
    inputs, output = {"in_color": color.astype(np.float16)}, ("out_resolved", "float32", 4)
    frame = {"history_valid": valid, "taa_alpha": alpha}
    if motion is None:
        return run_pass(ctx, RESOLVE, inputs, output, frame, {"HAS_MOTION": 0}, before=history)
    moving = {"prev_resolved": history.astype(np.float32), "in_motion": motion.astype(np.float16)}
    return run_pass(ctx, RESOLVE, inputs | moving, output, frame, {"HAS_MOTION": 1})


def colors(seed: int, count: int | None = None) -> np.ndarray:
    shape = (*SIZE, 4) if count is None else (count, *SIZE, 4)
    return np.random.default_rng(seed).random(shape).astype(np.float16)


def constant(value: float, frames: float) -> np.ndarray:
    return np.dstack([np.full((*SIZE, 3), value), np.full(SIZE, frames)])


def test_a_still_camera_averages_all_frames(ctx) -> None:
    frames = colors(1, 70)
    state = np.zeros((*SIZE, 4))
    for i, color in enumerate(frames):
        state = resolve(ctx, color, state, valid=int(i > 0))
    np.testing.assert_array_equal(state[..., 3], 70)
    # Each of 70 updates rounds a value below 1 to 6e-8.
    np.testing.assert_allclose(state[..., :3], frames[..., :3].astype(float).mean(0), atol=70 * 6e-8)


def test_a_reset_forgets(ctx) -> None:
    color = colors(2)
    got = resolve(ctx, color, constant(9.0, 50), valid=0)
    np.testing.assert_array_equal(got[..., :3], color[..., :3])
    np.testing.assert_array_equal(got[..., 3], 1)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_unusable_values_never_enter(ctx, bad) -> None:
    color = colors(3)
    color[5, 7, 1] = bad
    history = constant(0.5, 9)
    history[11, 3, 0] = bad
    motion = np.zeros((*SIZE, 2))
    for got in (
        resolve(ctx, color, history),
        resolve(ctx, color, history, motion=motion),
        resolve(ctx, color, history, valid=0),
    ):
        assert np.isfinite(got).all()


def test_moving_history_comes_from_where_the_surface_was(ctx) -> None:
    """A ramp that moved by (3, -2) px: the history under its old place equals today's picture, so nothing changes."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(float)
    ramp = lambda dx, dy: np.repeat((0.01 * (x - dx) + 0.02 * (y - dy) + 1.0)[..., None], 3, -1)  # noqa: E731
    now = np.dstack([ramp(3, -2), np.zeros(SIZE)])
    before = np.dstack([ramp(0, 0), np.full(SIZE, 9.0)])
    motion = np.broadcast_to([3.0, -2.0], (*SIZE, 2))
    got = resolve(ctx, now, before, motion=motion)
    inner = np.s_[4:-6, 6:-4]  # where all 4x4 texels of the old place lie inside
    np.testing.assert_allclose(got[inner][..., :3], now[inner][..., :3], atol=1e-3)  # float16 of values near 1
    np.testing.assert_array_equal(got[inner][..., 3], 10)
    np.testing.assert_array_equal(got[:, :3, 3], 1)  # was off screen: starts anew
    np.testing.assert_array_equal(got[-2:, :, 3], 1)


def test_implausible_history_is_clipped_away(ctx) -> None:
    got = resolve(ctx, constant(0.25, 0), constant(40.0, 9), motion=np.zeros((*SIZE, 2)))
    np.testing.assert_allclose(got[..., :3], 0.25, atol=1e-3)


def test_motion_bounds_how_much_the_past_counts(ctx) -> None:
    got = resolve(ctx, constant(0.5, 0), constant(0.5, 5000), motion=np.zeros((*SIZE, 2)), alpha=0.05)
    np.testing.assert_allclose(got[..., 3], 20, rtol=1e-6)


def test_catmull_rom_weights(ctx) -> None:
    f = np.linspace(0, 1, 33)
    wrapper = """vec4 merged(float f) {
    vec2 w0, w12, w3, o;
    catmull_rom_weights(vec2(f), w0, w12, w3, o);
    return vec4(w0.x, w12.x, w3.x, o.x);
}"""
    w0, w12, w3, offset = call_glsl(ctx, "lib/catmull_rom.glsl", "vec4 merged(float f)", f, extra=wrapper).T
    merged = np.stack([w0, w12 * (1 - offset), w12 * offset, w3], -1)
    np.testing.assert_allclose(merged, twin.catmull_rom(f), atol=5e-7)
    np.testing.assert_allclose(merged.sum(-1), 1, atol=5e-7)


def test_clip_to_box(ctx) -> None:
    rng = np.random.default_rng(4)
    point, centre, reach = rng.normal(size=(200, 3)) * 3, rng.normal(size=(200, 3)), rng.random((200, 3))
    reach[:20] = 0.0
    got = call_glsl(ctx, "lib/catmull_rom.glsl", "vec3 clip_to_box(vec3 p, vec3 c, vec3 r)", point, centre, reach)
    np.testing.assert_allclose(got, twin.clip_to_box(point, centre, reach), rtol=1e-5, atol=1e-5)
    assert (np.abs(got - centre) <= np.maximum(reach, 1e-6) * (1 + 1e-5) + 1e-6).all()
