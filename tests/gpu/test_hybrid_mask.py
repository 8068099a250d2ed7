"""The ray mask and the ray budget: edges, exact dilation, and rays that add up to what was allowed."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
from scipy import ndimage

from app.settings import Settings, put

from . import hybrid_twin as twin
from .hybrid_rig import BUDGETING, MASKING, HybridRig

W, H = 160, 96
RNG = np.random.default_rng(11)


def tiles_of(coc: np.ndarray) -> np.ndarray:
    h, w = -(-coc.shape[0] // 16) * 16, -(-coc.shape[1] // 16) * 16
    padded = np.pad(coc, ((0, h - coc.shape[0]), (0, w - coc.shape[1])), mode="edge").reshape(h // 16, 16, w // 16, 16)
    return np.stack([padded.min((1, 3)), padded.max((1, 3))], -1)


def give(rig: HybridRig, coc: np.ndarray, normal: np.ndarray | None = None) -> None:
    """Facing surfaces everywhere unless `normal` (h, w, 4), octahedral, says otherwise."""
    facing = np.zeros((*coc.shape, 4))
    facing[..., 3] = 1.0
    rig.give(coc=coc, normal=facing if normal is None else normal, tiles=tiles_of(coc))


def step_scene(near: float = -12.0, far: float = 6.0) -> np.ndarray:
    coc = np.full((H, W), far)
    coc[20:60, 40:90] = near
    return coc


def test_edges_match_the_twin(ctx: moderngl.Context) -> None:
    coc = step_scene() + 0.05 * np.arange(W) - 0.08 * np.arange(H)[:, None]
    coc[70:80, 100:140] = RNG.uniform(-20.0, -5.0, (10, 40))
    normal = np.zeros((H, W, 4))
    normal[..., 3] = 1.0
    normal[30:50, 50:70, 0] = 0.5  # octahedral (1/2, 0): the normal (1, 0, 1) / sqrt 2
    vectors = np.zeros((H, W, 3))
    vectors[..., 2] = 1.0
    vectors[30:50, 50:70] = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    with HybridRig(ctx, (W, H)) as rig:
        give(rig, coc, normal)
        rig.run(*MASKING)
        edges = rig.read("mask_edges")
    coc = coc.astype(np.float32).astype(np.float64)
    response = twin.mask_response(twin.mask_gradient(vectors, coc, 1.0), 1.0)
    nearest = ndimage.minimum_filter(coc.reshape(H // 2, 2, W // 2, 2).min((1, 3)), 3, mode="nearest")
    reach = twin.edge_reach_half(nearest)
    expected = np.where((response >= 0.1) & (reach > 0.0), response, 0.0)
    decided = np.abs(response - 0.1) > 1e-4  # at the threshold itself rounding decides
    np.testing.assert_allclose(edges[..., 0][decided], expected[decided], atol=1e-3)  # float16 target
    np.testing.assert_allclose(edges[..., 1], np.where(edges[..., 0] > 0.0, reach, 0.0), rtol=1e-3)
    assert (expected > 0.0).sum() > 200


@pytest.mark.parametrize("slope", [(0.6, 0.0), (0.0, -0.4), (0.3, 0.3)])
def test_a_slanted_plane_has_no_edges_even_at_the_border(ctx: moderngl.Context, slope: tuple[float, float]) -> None:
    y, x = np.mgrid[:H, :W]
    with HybridRig(ctx, (W, H)) as rig:
        give(rig, -10.0 + slope[0] * x + slope[1] * y)
        rig.run(*MASKING)
        assert not rig.read("mask").any()


def test_far_edges_alone_need_no_rays(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        give(rig, step_scene(near=0.0, far=30.0))
        rig.run(*MASKING)
        assert not rig.read("mask").any()


def test_a_twig_one_pixel_wide_is_found(ctx: moderngl.Context) -> None:
    for column in (80, 81):
        coc = np.full((H, W), 4.0)
        coc[:, column] = -10.0
        with HybridRig(ctx, (W, H)) as rig:
            give(rig, coc)
            rig.run(*MASKING)
            mask = rig.read("mask")[..., 0]
        assert (mask[:, 40 - 5 : 40 + 6] > 0.0).all()


def test_dilation_is_that_by_discs_and_never_smaller(ctx: moderngl.Context) -> None:
    coc = np.full((H, W), 3.0)
    for _ in range(25):  # specks of every blur, more than a tile and less
        y, x = RNG.integers(0, H - 3), RNG.integers(0, W - 3)
        coc[y : y + 3, x : x + 3] = -RNG.choice([1.0, 3.0, 8.0, 20.0, 45.0, 60.0])  # below the first halving
    with HybridRig(ctx, (W, H)) as rig:
        give(rig, coc)
        rig.run(*MASKING)
        edges, mask = rig.read("mask_edges"), rig.read("mask")
    response, feather = twin.dilated(edges[..., 0], edges[..., 1])
    np.testing.assert_array_equal(mask[..., 0] > 0.0, response > 0.0)
    # A row keeps its strongest edge only: a pixel may take the response of another that covers it, never a stronger.
    assert (mask[..., 0] <= response + 1 / 255).all()
    assert (mask[..., 1] <= feather + 1e-3).all()


@pytest.mark.parametrize("blur", [70.0, 150.0])
def test_a_coarser_mask_loses_no_pixel_and_adds_less_than_its_texel(ctx: moderngl.Context, blur: float) -> None:
    coc = np.full((H, W), 3.0)
    for _ in range(6):
        y, x = RNG.integers(0, H - 3), RNG.integers(0, W - 3)
        coc[y : y + 3, x : x + 3] = -RNG.choice([3.0, 8.0, 20.0])
    coc[40:43, 100:103] = -blur
    with HybridRig(ctx, (W, H)) as rig:
        give(rig, coc)
        rig.run(*MASKING)
        edges, mask = rig.read("mask_edges"), rig.read("mask")[..., 0] > 0.0
    side = 1 << twin.mask_level(edges[..., 1].max())
    assert side == {70.0: 2, 150.0: 4}[blur]
    grown = np.where(edges[..., 1] > 0.0, edges[..., 1] + 2.0 * twin.coarse_margin_half(side) + 0.1, 0.0)
    least, most = (twin.dilated(edges[..., 0], reach)[0] > 0.0 for reach in (edges[..., 1], grown))
    assert (mask >= least).all()
    assert (mask <= most).all()


def test_the_dilation_reaches_all_that_the_lens_smears_an_edge_over(ctx: moderngl.Context) -> None:
    coc = step_scene(near=-17.0)
    with HybridRig(ctx, (W, H)) as rig:
        give(rig, coc)
        rig.run(*MASKING)
        mask = np.repeat(np.repeat(rig.read("mask")[..., 0], 2, 0), 2, 1)
    inside = coc < 0.0
    silhouette = inside & ~ndimage.binary_erosion(inside)
    assert (mask[ndimage.distance_transform_edt(~silhouette) <= 17.0] > 0.0).all()


@pytest.mark.parametrize(("budget", "most"), [(4.0, 16), (1.0, 16), (0.25, 16), (7.3, 8), (32.0, 16), (2.5, 256)])
def test_rays_add_up_to_the_budget(ctx: moderngl.Context, budget: float, most: int) -> None:
    settings = put(put(Settings(), "rays.budget", budget), "rays.max_per_pixel", most)
    coc = step_scene()
    coc[70:90, 10:150] = RNG.uniform(-9.0, 3.0, (20, 140))
    with HybridRig(ctx, (W, H), settings) as rig:
        give(rig, coc)
        counts = []
        for frame in range(4):
            rig.run(*MASKING, *BUDGETING, frame_index=frame, history_valid=int(frame > 0))
            counts.append(rig.read("ray_count"))
            rig.swap()
        levels = np.rint(255 * rig.read("mask")[..., 0]).astype(int)
        work = rig.block("RayWork")
        scale = rig.block("RayBudget", "<f4")[0]
    masked = levels > 0
    rays = np.array([c[..., 0] for c in counts])
    assert not rays[:, ~masked].any()
    assert rays.max() <= most
    assert rays[:, masked].min() >= (1 if budget >= 1.0 else 0)
    assert rays[:, masked].mean() == pytest.approx(min(budget, most), rel=0.02)
    histogram = np.bincount(levels[masked], minlength=256)
    planned = [
        twin.planned_rays(levels[masked], s, min(1.0, budget), most)
        for s in (scale, twin.rays_per_level(histogram, budget, most))
    ]
    np.testing.assert_allclose(*planned, rtol=1e-4)
    np.testing.assert_array_equal(counts[3][..., 1], rays[:3].sum(0))  # samples go on where the last frame ended
    listed = work[4 : 4 + work[3]]
    assert work[3] == (rays[3] > 0).sum()
    assert work[0] == -(-work[3] // 64)
    assert {(p & 0xFFFF, p >> 16) for p in listed.tolist()} == {(x, y) for y, x in np.argwhere(rays[3] > 0)}


def test_nothing_near_lists_nothing(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (W, H)) as rig:
        give(rig, np.full((H, W), 5.0))
        rig.run(*MASKING, *BUDGETING)
        assert rig.block("RayWork")[:4].tolist() == [0, 1, 1, 0]


def test_the_mask_is_the_same_every_time(ctx: moderngl.Context) -> None:
    pictures = []
    for _ in range(2):
        with HybridRig(ctx, (W, H)) as rig:
            give(rig, step_scene())
            rig.run(*MASKING, *BUDGETING)
            pictures.append((rig.read("mask"), rig.read("ray_count")))
    for first, second in zip(*pictures):
        np.testing.assert_array_equal(first, second)


def test_without_edges_every_pixel_is_masked(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (96, 64)) as rig:
        rig.run("mask")
        assert (rig.read("mask")[..., 1] == 1.0).all()
        assert rig.block("RayHistogram").sum() == 48 * 32
