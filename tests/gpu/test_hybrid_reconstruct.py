"""Spatial reconstruction takes noise away, and nothing else: identities, and what it must not mix."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.settings import Settings, put

from .hybrid_rig import HybridRig

W, H = 64, 48
HALF = (H // 2, W // 2)
RNG = np.random.default_rng(11)
FLOAT16 = 2.0**-10  # relative: one rounding to a float16 target and one more on the way there
RAYS = 4.0


def light(color: np.ndarray | float, share: np.ndarray) -> np.ndarray:
    """A premultiplied layer of one colour, or one colour a pixel (h, w)."""
    rgb = np.broadcast_to(np.asarray(color, np.float64)[..., None], (*HALF, 3))
    return np.concatenate([rgb * share[..., None], share[..., None]], -1)


def reconstructed(
    ctx: moderngl.Context,
    near: np.ndarray,
    far: np.ndarray,
    coc: tuple[float, float] = (-24.0, 24.0),
    variance: float | np.ndarray = 1.0,
    held: np.ndarray | float = 1.0,
    settings: Settings | None = None,
    rays: float = RAYS,
) -> tuple[np.ndarray, np.ndarray]:
    """Both layers after the pass, their statistics made from `near`, `far` and the given variance per ray."""
    count = np.broadcast_to(rays * held, HALF)
    state = np.stack([count, count, near[..., 3], np.broadcast_to(held, HALF)], -1)
    with HybridRig(ctx, (W, H), settings) as rig:
        rig.give(near_light=near, far_light=far, layer_state=state)
        rig.give(layer_coc=np.broadcast_to(coc, (*HALF, 2)), layer_moments=moments(near[..., 0], far[..., 0], variance))
        rig.run("smoothing", "reconstruct")
        return rig.read("near_smooth"), rig.read("far_smooth")


def moments(near: np.ndarray, far: np.ndarray, variance: float | np.ndarray) -> np.ndarray:
    """Means of the near and the far part's light, with as much variance per ray."""
    return np.stack([near, near**2 + variance, far, far**2 + variance], -1)


def ratios() -> np.ndarray:
    """Hit ratios of a few rays."""
    return RNG.integers(0, 5, HALF) / 4.0


def test_one_colour_stays_that_colour_whatever_the_hit_ratios(ctx: moderngl.Context) -> None:
    ratio = ratios()
    near, far = reconstructed(ctx, light(0.5, ratio), light(0.5, 1.0 - ratio))
    np.testing.assert_allclose((near + far)[..., :3], 0.5, rtol=2 * FLOAT16)
    np.testing.assert_allclose((near + far)[..., 3], 1.0, rtol=2 * FLOAT16)
    assert near[..., 3].std() < 0.5 * ratio.std()


def test_constant_layers_stay_as_they_are(ctx: moderngl.Context) -> None:
    ratio = np.full(HALF, 0.25)
    given = light(0.75, ratio), light(0.125, 1.0 - ratio)
    for got, expected in zip(reconstructed(ctx, *given), given):
        np.testing.assert_allclose(got, expected, rtol=2 * FLOAT16)


def test_a_converged_pixel_is_left_alone(ctx: moderngl.Context) -> None:
    ratio = RNG.uniform(0.1, 0.9, HALF)
    given = light(RNG.random(HALF), ratio), light(RNG.random(HALF), 1.0 - ratio)
    for got, expected in zip(reconstructed(ctx, *given, rays=1e6), given):
        np.testing.assert_allclose(got, np.float16(expected), rtol=3 * FLOAT16, atol=1e-3)


@pytest.mark.parametrize("rays", [4, 16])
def test_light_is_neither_made_nor_lost(ctx: moderngl.Context, rays: int) -> None:
    """Sparse hits within one blur: what the pixels give is what others take, though their noise differs."""
    hit = np.zeros(HALF)
    hit[6:-6, 6:-6] = RNG.binomial(rays, 0.1, (HALF[0] - 12, HALF[1] - 12)) / rays
    variance = hit * (1.0 - hit)
    near, _ = reconstructed(ctx, light(1.0, hit), light(0.0, 1.0 - hit), variance=variance, rays=float(rays))
    assert near[..., 3].std() < 0.8 * hit.std()
    np.testing.assert_allclose(near.sum((0, 1)), light(1.0, hit).sum((0, 1)), rtol=FLOAT16)


def test_what_is_in_focus_behind_a_blur_stays_sharp(ctx: moderngl.Context) -> None:
    ratio = np.full(HALF, 0.5)
    behind = RNG.random(HALF)
    _, far = reconstructed(ctx, light(0.5, ratio), light(behind, 1.0 - ratio), coc=(-24.0, 0.3))
    np.testing.assert_allclose(far, light(behind, 1.0 - ratio), rtol=3 * FLOAT16, atol=1e-3)


def test_a_sample_whose_blur_ends_before_the_pixel_does_not_leak_in(ctx: moderngl.Context) -> None:
    """Left half: bright, CoC 1 px, reaches one texel at most. Right half: dark, widely blurred."""
    left = np.arange(HALF[1])[None] < HALF[1] // 2
    left = np.broadcast_to(left, HALF)
    ratio = np.ones(HALF)
    near = light(np.where(left, 1.0, 0.0), ratio)
    coc = np.stack([np.where(left, -1.0, -40.0), ratio * 0.0], -1)
    with HybridRig(ctx, (W, H), put(Settings(), "reconstruct.radius", 1.0)) as rig:
        state = np.stack([ratio * RAYS, ratio * RAYS, ratio, ratio], -1)
        rig.give(near_light=near, far_light=light(0.0, 1.0 - ratio), layer_state=state, layer_coc=coc)
        rig.give(layer_moments=moments(near[..., 0], 0.0 * ratio, 1.0))
        rig.run("smoothing", "reconstruct")
        smooth = rig.read("near_smooth")
    np.testing.assert_allclose(smooth[..., 0], near[..., 0], atol=FLOAT16)


def test_pixels_without_rays_neither_give_nor_take(ctx: moderngl.Context) -> None:
    held = np.rint(RNG.random(HALF))
    ratio = np.full(HALF, 0.5)
    color = np.where(held > 0.0, 0.5, 99.0)
    near, far = reconstructed(ctx, light(color, ratio), light(color, 1.0 - ratio), held=held)
    np.testing.assert_allclose(
        (near + far)[held > 0.0], np.broadcast_to([0.5, 0.5, 0.5, 1.0], (int(held.sum()), 4)), rtol=2 * FLOAT16
    )


def test_a_noisy_ratio_keeps_its_mean_and_loses_its_noise(ctx: moderngl.Context) -> None:
    ratio = RNG.binomial(int(RAYS), 0.5, HALF) / RAYS
    near, far = reconstructed(ctx, light(1.0, ratio), light(0.0, 1.0 - ratio), variance=ratio * (1.0 - ratio))
    inside = near[6:-6, 6:-6, 3]
    assert inside.mean() == pytest.approx(ratio[6:-6, 6:-6].mean(), abs=0.02)
    assert inside.std() < 0.5 * ratio[6:-6, 6:-6].std()
    assert np.isfinite(near).all()
    assert np.isfinite(far).all()


def test_where_no_ray_hit_far_anywhere_near_covers_the_pixel(ctx: moderngl.Context) -> None:
    ones = np.ones(HALF)
    near, far = reconstructed(ctx, light(0.5, ones), light(0.0, ones * 0.0))
    np.testing.assert_allclose(near, light(0.5, ones), rtol=2 * FLOAT16)
    assert not far.any()
