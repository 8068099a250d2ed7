"""Accumulation keeps energy and follows motion; the composite lays traced light only where the rays know better."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.settings import Settings, put

from . import hybrid_twin as twin
from .hybrid_rig import HybridRig

W, H = 64, 48
HALF = (H // 2, W // 2)
RNG = np.random.default_rng(3)
MASKED = np.stack([np.ones(HALF), np.ones(HALF)], -1)
FLOAT16 = 2.0**-10  # relative: one rounding to a float16 target and one more on the way there
POSITION = 1e-5  # a texel position near 32 rounds by 2^-19, which a bilinear fetch turns into as much of the values


def counts(rays: np.ndarray | float) -> np.ndarray:
    return np.stack([np.broadcast_to(rays, HALF), np.zeros(HALF)], -1)


def layer(color: np.ndarray | float, share: np.ndarray) -> np.ndarray:
    return np.concatenate([np.broadcast_to(color, (*HALF, 3)) * share[..., None], share[..., None]], -1)


def state(rays: float) -> np.ndarray:
    return np.broadcast_to(np.array([rays, rays, 0.5, 1.0]), (*HALF, 4))


def random_frame(rig: HybridRig, color: float) -> tuple[np.ndarray, np.ndarray]:
    """One frame's rays of one colour throughout, with random hit ratios and ray counts."""
    rays = RNG.integers(1, 16, HALF).astype(float)
    ratio = np.float16(np.rint(RNG.random(HALF) * 64) / 64).astype(float)  # exact in float16, and so is 1 - ratio
    zero = np.zeros((*HALF, 4))
    rig.give(
        mask=MASKED,
        ray_count=counts(rays),
        trace_near=layer(color, ratio),
        trace_far=layer(color, 1.0 - ratio),
        trace_motion=zero,
    )
    return rays, ratio


def test_a_still_camera_keeps_the_mean_over_all_rays_and_its_energy(ctx: moderngl.Context) -> None:
    hits, total = np.zeros(HALF), np.zeros(HALF)
    with HybridRig(ctx, (W, H)) as rig:
        for frame in range(5):
            rays, ratio = random_frame(rig, 0.5)
            rig.run("accumulate", history_valid=int(frame > 0))
            near, far, kept = rig.read("near_layer"), rig.read("far_layer"), rig.read("layer_state")
            rig.swap()
            hits += rays * ratio
            total += rays
    np.testing.assert_allclose(near[..., 3], hits / total, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(near[..., :3] + far[..., :3], 0.5, rtol=1e-5)
    np.testing.assert_allclose(kept[..., 0], total, rtol=1e-5)
    np.testing.assert_allclose(kept[..., 2], hits / total, rtol=1e-5, atol=1e-6)


def test_motion_composes_to_the_same_energy(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        for frame in range(4):
            random_frame(rig, 0.5)
            rig.give(trace_motion=np.broadcast_to(np.array([3.0, 1.0, -2.0, 0.5]), (*HALF, 4)))
            rig.run("accumulate", history_valid=int(frame > 0), moved=1)
            light = rig.read("near_light") + rig.read("far_light")
            rig.swap()
    np.testing.assert_allclose(light[..., :3], 0.5, rtol=2 * FLOAT16)
    np.testing.assert_allclose(light[..., 3], 1.0, rtol=2 * FLOAT16)


def test_each_layer_is_fetched_from_where_it_was(ctx: moderngl.Context) -> None:
    """Near moved by (4, -2) full-res px, far by (-6, 0): (2, -1) and (-3, 0) half-res px."""
    before = {"near_layer": RNG.random((*HALF, 4)), "far_layer": RNG.random((*HALF, 4))}
    ratio = np.full(HALF, 0.5)
    settings = put(Settings(), "rays.history", 0.0)
    with HybridRig(ctx, (W, H), settings) as rig:
        rig.give(previous=True, layer_state=state(1e7), **before)
        rig.give(mask=MASKED, ray_count=counts(1.0), trace_near=layer(0.5, ratio), trace_far=layer(0.5, ratio))
        rig.give(trace_motion=np.broadcast_to(np.array([4.0, -2.0, -6.0, 0.0]), (*HALF, 4)))
        rig.run("accumulate", history_valid=1, moved=1)
        near, far, kept = rig.read("near_layer"), rig.read("far_layer"), rig.read("layer_state")
    np.testing.assert_allclose(near[:-1, 2:], before["near_layer"][1:, :-2], atol=POSITION)
    np.testing.assert_allclose(far[:, :-3], before["far_layer"][:, 3:], atol=POSITION)
    # What comes from off screen starts afresh.
    np.testing.assert_allclose(near[:, :2, 3], 0.5)
    assert (kept[:, :2, 0] == 1.0).all()
    assert (kept[:, -3:, 1] == 1.0).all()


def test_where_no_ray_hit_a_layer_it_moves_as_its_neighbours_do(ctx: moderngl.Context) -> None:
    before = RNG.random((*HALF, 4))
    share = np.full(HALF, 0.5)
    share[10, 10] = 1.0  # no far hit here
    motion = np.broadcast_to(np.array([0.0, 0.0, 4.0, 0.0]), (*HALF, 4)).copy()
    motion[10, 10] = 0.0
    settings = put(Settings(), "rays.history", 0.0)
    with HybridRig(ctx, (W, H), settings) as rig:
        rig.give(previous=True, layer_state=state(1e7), near_layer=before, far_layer=before)
        rig.give(
            mask=MASKED,
            ray_count=counts(1.0),
            trace_near=layer(0.5, share),
            trace_far=layer(0.5, 1.0 - share),
            trace_motion=motion,
        )
        rig.run("accumulate", history_valid=1, moved=1)
        far = rig.read("far_layer")
    np.testing.assert_allclose(far[10, 10], before[10, 8], atol=POSITION)


def test_a_pixel_that_leaves_the_mask_keeps_nothing(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        random_frame(rig, 0.5)
        rig.give(
            previous=True, layer_state=state(100.0), near_layer=RNG.random((*HALF, 4)), far_layer=RNG.random((*HALF, 4))
        )
        rig.give(mask=np.zeros((*HALF, 2)))
        rig.run("accumulate", history_valid=1)
        assert not any(rig.read(t).any() for t in ("near_layer", "far_layer", "layer_state", "near_light", "far_light"))


@pytest.mark.parametrize("latest", [0.0, 0.25])
def test_a_ghost_in_the_hit_ratio_is_clipped(ctx: moderngl.Context, latest: float) -> None:
    """History says near, the rays of this frame say mostly or all far. A layer without hits has no history."""
    none = np.zeros(HALF)
    with HybridRig(ctx, (W, H)) as rig:
        rig.give(previous=True, layer_state=state(80.0), near_layer=layer(1.0, none + 1.0), far_layer=layer(1.0, none))
        rig.give(
            mask=MASKED,
            ray_count=counts(4.0),
            trace_near=layer(0.5, none + latest),
            trace_far=layer(0.5, none + 1.0 - latest),
            trace_motion=np.zeros((*HALF, 4)),
        )
        rig.run("accumulate", history_valid=1, moved=1)
        ratio = rig.read("layer_state")[5:-5, 5:-5, 2]
    expected = twin.trusted_ratio(1.0, latest, 36.0) if latest else 0.0
    np.testing.assert_allclose(ratio, expected, rtol=1e-5)
    assert ratio.max() < latest + 0.2


def test_history_of_another_depth_is_dropped(ctx: moderngl.Context) -> None:
    share = np.full(HALF, 0.5)
    with HybridRig(ctx, (W, H)) as rig:
        rig.give(previous=True, layer_state=state(1e6), near_layer=layer(1.0, share), far_layer=layer(1.0, share))
        rig.give(previous=True, layer_coc=np.broadcast_to([-20.0, 8.0], (*HALF, 2)))
        rig.give(mask=MASKED, ray_count=counts(4.0), trace_near=layer(0.5, share), trace_far=layer(0.5, share))
        rig.give(trace_motion=np.zeros((*HALF, 4)), trace_spread=np.broadcast_to([-10.0, 8.5, 0.0, 0.0], (*HALF, 4)))
        rig.run("accumulate", history_valid=1, moved=1)
        state_now = rig.read("layer_state")[5:-5, 5:-5]
    np.testing.assert_allclose(state_now[..., 0], 4.0)  # nothing but this frame's rays
    assert (state_now[..., 1] > 4.0).all()


@pytest.mark.parametrize("drift", [0.0, 8.0])
def test_history_is_shortened_where_one_layer_s_hits_move_apart(ctx: moderngl.Context, drift: float) -> None:
    """Half of the near hits move by +drift, half by -drift px: the mean motion fits neither."""
    share = np.full(HALF, 0.5)
    with HybridRig(ctx, (W, H)) as rig:
        rig.give(previous=True, layer_state=state(1e6), near_layer=layer(1.0, share), far_layer=layer(1.0, share))
        rig.give(previous=True, layer_coc=np.broadcast_to([-20.0, 8.0], (*HALF, 2)))
        rig.give(mask=MASKED, ray_count=counts(4.0), trace_near=layer(0.5, share), trace_far=layer(0.5, share))
        spread = np.broadcast_to([-20.0, 8.0, drift**2, 0.0], (*HALF, 4))
        rig.give(trace_motion=np.zeros((*HALF, 4)), trace_spread=spread)
        rig.run("accumulate", history_valid=1, moved=1)
        rays = rig.read("layer_state")[5:-5, 5:-5, :2]
    floor = rig.settings.rays.history
    np.testing.assert_allclose(rays[..., 0], 4.0 / twin.stale_weight(floor, 0.0, drift, -20.0), rtol=1e-4)
    np.testing.assert_allclose(rays[..., 1], 4.0 / floor, rtol=1e-4)


def give_picture(
    rig: HybridRig, coc: float, ratio: float, feather: float, **changed: np.ndarray
) -> dict[str, np.ndarray]:
    """Random full-resolution pictures and traced layers with one hit ratio; `changed` replaces any of them."""
    share = np.full(HALF, ratio)
    arrays = {
        "post_behind": RNG.random((H, W, 4)),
        "coc": np.full((H, W), coc),
        "post": np.concatenate([RNG.random((H, W, 3)), np.zeros((H, W, 1))], -1),
        "far_blur": np.concatenate([RNG.random((*HALF, 3)), np.ones((*HALF, 1))], -1),
        "mask": np.stack([share * 0 + float(feather > 0.0), share * 0 + feather], -1),
        "near_smooth": layer(0.25, share),
        "far_smooth": layer(0.75, 1.0 - share),
        "layer_state": np.broadcast_to(np.array([4.0, 4.0, ratio, 1.0]), (*HALF, 4)),
        **changed,
    }
    rig.give(**arrays)
    return {name: np.float16(a).astype(float) for name, a in arrays.items()}


def test_outside_the_mask_the_picture_is_the_post_process_bit_for_bit(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        given = give_picture(rig, coc=9.0, ratio=0.4, feather=0.0)
        rig.run("composite")
        np.testing.assert_array_equal(rig.read("hybrid")[..., :3], given["post"][..., :3])


def test_where_rays_hold_nothing_the_picture_is_the_post_process(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        given = give_picture(rig, coc=9.0, ratio=0.4, feather=1.0, layer_state=np.zeros((*HALF, 4)))
        rig.run("composite")
        np.testing.assert_array_equal(rig.read("hybrid")[..., :3], given["post"][..., :3])


@pytest.mark.parametrize("ratio", [0.0, 0.3])
def test_what_is_in_focus_behind_blur_keeps_full_resolution(ctx: moderngl.Context, ratio: float) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        given = give_picture(rig, coc=0.3, ratio=ratio, feather=1.0)
        rig.run("composite")
        expected = ratio * 0.25 + (1.0 - ratio) * given["post_behind"][..., :3]
        np.testing.assert_allclose(rig.read("hybrid")[..., :3], expected, rtol=2 * FLOAT16, atol=1e-3)


@pytest.mark.parametrize(("ratio", "coc"), [(0.4, 12.0), (0.4, -12.0), (0.9, 12.0)])
def test_below_the_threshold_the_rays_alone_say_what_a_blurred_pixel_is(
    ctx: moderngl.Context, ratio: float, coc: float
) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        give_picture(rig, coc=coc, ratio=ratio, feather=1.0)
        rig.run("composite")
        np.testing.assert_allclose(rig.read("hybrid")[..., :3], ratio * 0.25 + (1.0 - ratio) * 0.75, rtol=2 * FLOAT16)


def test_bright_specular_bokeh_stays_the_post_process(ctx: moderngl.Context) -> None:
    post = np.concatenate([10.0 + RNG.random((H, W, 3)), np.full((H, W, 1), 8.0)], -1)
    with HybridRig(ctx, (W, H)) as rig:
        given = give_picture(rig, coc=-12.0, ratio=0.4, feather=1.0, post=post)
        rig.run("composite")
        np.testing.assert_array_equal(rig.read("hybrid")[..., :3], given["post"][..., :3])


def test_one_colour_everywhere_stays_that_colour(ctx: moderngl.Context) -> None:
    """A white furnace: whatever the weights, they add up to one."""
    ratio = RNG.random(HALF)
    flat = np.full((H, W, 4), 0.5)
    flat[..., 3] = RNG.uniform(0.0, 10.0, (H, W))
    far = np.full((*HALF, 4), 0.5)
    far[..., 3] = RNG.random(HALF)
    layers = {"near_smooth": layer(0.5, ratio), "far_smooth": layer(0.5, 1.0 - ratio)}
    held = np.stack([ratio * 0 + 4.0, ratio * 0 + 4.0, ratio, np.rint(RNG.random(HALF))], -1)
    mask = np.stack([np.ones(HALF), RNG.random(HALF)], -1)
    with HybridRig(ctx, (W, H)) as rig:
        give_picture(
            rig, 0.0, 0.5, 1.0, post_behind=flat, post=flat, far_blur=far, layer_state=held, mask=mask, **layers
        )
        rig.give(coc=RNG.uniform(-4.0, 4.0, (H, W)))
        rig.run("composite")
        np.testing.assert_allclose(rig.read("hybrid")[..., :3], 0.5, rtol=3 * FLOAT16)
