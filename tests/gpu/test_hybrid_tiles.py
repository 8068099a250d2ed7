"""The hybrid's lists of tiles: none is missing, and what is drawn over them is what is drawn over the whole picture."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import moderngl
import numpy as np
import pytest
from scipy import ndimage

from app.data import data_dir
from app.frame.mask import NO_RAYS, RAYS
from app.frame.records import KERNEL_BYTES
from app.frame.targets import BUFFERS, RAY_CLASSES, TARGETS
from app.gpu.programs import Programs
from app.gpu.rehearsal import Rehearsal
from app.gpu.shaders import load_glsl
from app.renderer import Renderer
from app.scene.facts import Facts
from app.settings import Settings, put

from ..image.stage import opened
from . import hybrid_twin as twin
from .hybrid_rig import BUDGETING, LAYERS, MASKING, PASSES, HybridRig
from .test_hybrid_mask import give, tiles_of

SIZES = ((325, 187), (160, 96), (17, 33), (5, 3))
ALL = Facts(near_coc_px=50.0, far_coc_px=50.0)
RNG = np.random.default_rng(23)


def specks(size: tuple[int, int], rng: np.random.Generator, count: int = 6) -> np.ndarray:
    """CoC radii (h, w): a little blur behind focus, and specks in front of it, here and there."""
    width, height = size
    coc = rng.uniform(0.0, 3.0, (height, width))
    for _ in range(count):
        y, x, side = rng.integers(0, height), rng.integers(0, width), rng.integers(1, 12)
        coc[y : y + side, x : x + side] = -rng.choice([1.9, 2.1, 5.0, 12.0, 30.0])
    return coc


def scouts(size: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """What scouts found (rows, columns, 2): mostly nothing, some too little to count, some enough."""
    shape = -(-size[1] // 16), -(-size[0] // 16)
    found = rng.choice([0.0, 0.009, 0.0101, 0.3], shape, p=[0.9, 0.05, 0.02, 0.03])
    return np.stack([found, np.full(shape, 8.0)], -1)


def listed(rig: HybridRig, block: str, classes: int, shape: tuple[int, ...]) -> np.ndarray:
    """The class of each tile (rows, columns), -1 where it is in no list; each is in one list once."""
    words = rig.block(block)
    heads, lists = words[: 4 * classes].reshape(classes, 4), words[4 * classes :].reshape(classes, -1)
    found = np.full(shape, -1)
    for index, (x, y, z, count) in enumerate(heads):
        assert (x, y, z) == (count, 1, 1)
        tiles = lists[index, :count]
        assert (found[tiles >> 16, tiles & 0xFFFF] == -1).all()
        assert len(np.unique(tiles)) == count
        found[tiles >> 16, tiles & 0xFFFF] = index
    return found


@pytest.mark.parametrize("size", SIZES)
def test_edges_are_looked_for_in_and_about_tiles_with_near_blur(ctx: moderngl.Context, size: tuple[int, int]) -> None:
    for _ in range(4):
        coc = specks(size, RNG, 2)
        near = tiles_of(coc)[..., 0] <= -min(2.0, 0.12 * size[1])
        with HybridRig(ctx, size) as rig:
            give(rig, coc)
            rig.run("edge_tiles")
            found = listed(rig, "EdgeTiles", 1, near.shape)
        np.testing.assert_array_equal(found == 0, ndimage.maximum_filter(near, 3))


def test_a_post_process_that_gathers_little_takes_no_rays_away(ctx: moderngl.Context) -> None:
    """It sees no circle of confusion beyond its own limit, which may be less than rays begin at."""
    coc = np.full((64, 96), 5.0)
    coc[20:40, 30:60] = -20.0
    found = []
    for limit in (0.5, 1.8, 2.0, 2.1, 30.0):
        with HybridRig(ctx, (96, 64)) as rig:
            give(rig, coc)
            rig.run("tiles", *MASKING, max_coc_px=limit)
            found.append(rig.read("mask"))
    assert found[-1].any()
    for mask in found:
        np.testing.assert_array_equal(mask, found[-1])


def test_more_tiles_than_a_row_of_work_groups_holds(ctx: moderngl.Context) -> None:
    size = 16384, 544
    with HybridRig(ctx, size) as rig:
        rig.give(tiles=np.full((34, 1024, 2), -5.0))
        rig.run("edge_tiles")
        words = rig.block("EdgeTiles")
        assert words[:4].tolist() == [32768, 2, 1, 34 * 1024]
        assert len(np.unique(words[4:])) == 34 * 1024


@pytest.mark.parametrize("size", SIZES)
def test_rays_are_laid_in_and_about_tiles_that_edges_reach_or_scouts_tell_of(
    ctx: moderngl.Context, size: tuple[int, int]
) -> None:
    for _ in range(4):
        found = scouts(size, RNG)
        with HybridRig(ctx, size) as rig:
            give(rig, specks(size, RNG, 2))
            rig.give(scout=found)
            rig.run(*MASKING)
            reached, mask = rig.read("mask_reach")[..., 0] > 0.0, rig.read("mask").any(-1)
            classes = listed(rig, "RayTiles", RAY_CLASSES, reached.shape)
        told = twin.scouted_share(ndimage.maximum_filter(found[..., 0].astype(np.float32), 5)) > 0.0
        rays = ndimage.maximum_filter(reached, 3) | told
        np.testing.assert_array_equal(classes, np.where(rays, RAYS, NO_RAYS))
        # A pixel that is interpolated from one with rays has its tile listed.
        spread = ndimage.maximum_filter(mask, 3)
        assert (classes.repeat(8, 0).repeat(8, 1)[: mask.shape[0], : mask.shape[1]][spread] == RAYS).all()


def test_without_edges_rays_go_everywhere(ctx: moderngl.Context) -> None:
    with HybridRig(ctx, (70, 40), put(Settings(), "mask.edges", False)) as rig:
        rig.run("ray_tiles")
        assert (listed(rig, "RayTiles", RAY_CLASSES, (3, 5)) == RAYS).all()


def give_rays(rig: HybridRig, rng: np.random.Generator, size: tuple[int, int]) -> None:
    """What rays of this frame could have brought, and a post-process, made up."""
    shape = -(-size[1] // 2), -(-size[0] // 2)
    ratio = np.rint(4.0 * rng.random((*shape, 1))) / 4.0
    light = rng.random((*shape, 3))
    rig.give(trace_near=np.concatenate([light * ratio, ratio], -1))
    rig.give(trace_far=np.concatenate([light * (1.0 - ratio), 1.0 - ratio], -1))
    rig.give(trace_motion=rng.uniform(-2.0, 2.0, (*shape, 4)), trace_moments=rng.random((*shape, 4)))
    rig.give(trace_spread=rng.uniform(0.0, 9.0, (*shape, 4)) * [-1.0, 1.0, 1.0, 1.0])
    rig.give(post=rng.random((size[1], size[0], 4)), post_behind=rng.random((size[1], size[0], 4)))
    rig.give(far_blur=rng.random((*shape, 4)))


def frame_of(rig: HybridRig, size: tuple[int, int], index: int, everywhere: bool, moved: bool) -> dict[str, np.ndarray]:
    """All that the mask and the layers write in one frame, by target: blur and scouts' finds change places."""
    rng = np.random.default_rng(100 + index)
    give(rig, specks(size, rng))
    give_rays(rig, rng, size)
    rig.give(scout=scouts(size, rng))
    if moved:
        rig.give(motion=rng.uniform(-3.0, 3.0, (size[1], size[0], 2)))
    state = {"history_valid": int(index > 0), "moved": int(moved), "frame_index": index, "layer_fade_px": 2.0}
    rig.run(*MASKING, *BUDGETING, *LAYERS, everywhere=everywhere, **state)
    names = {target for name in (*MASKING, *BUDGETING, *LAYERS) for target in PASSES[name].writes}
    written = {name: rig.read(name) for name in sorted(names)}
    rig.swap()
    return written


GUIDES = {"mask_guide", "mask_slope", "mask_smooth_row", "mask_smooth"}


@pytest.mark.parametrize("moved", [False, True])
@pytest.mark.parametrize("size", SIZES)
def test_lists_change_no_bit(ctx: moderngl.Context, size: tuple[int, int], moved: bool) -> None:
    """Every target of the mask and of the layers, over frames of made-up rays. What edges are found by alone is nothing
    outside of the tiles that they are looked for in.
    """
    runs = []
    for everywhere in (False, True):
        with HybridRig(ctx, size) as rig:
            runs.append([frame_of(rig, size, index, everywhere, moved) for index in range(4)])
    for drawn, whole in zip(*runs, strict=True):
        for name in whole.keys() - GUIDES:
            np.testing.assert_array_equal(drawn[name], whole[name], err_msg=name)
    if min(size) > 90:
        masks = [frame["mask"].any(-1) for frame in runs[1]]
        assert all(0.02 < mask.mean() < 0.98 for mask in masks), "some tiles with rays and some without"
        assert (masks[0] & ~masks[1]).any(), "rays go, and what they left must go with them"


EVERYWHERE = {
    "dof/edge_tiles.comp": ("nearest <= -min(RAYS_BEGIN_PX, frame.max_coc_px)", "true"),
    "dof/ray_tiles.comp": ("class_ = uint(NO_RAYS)", "class_ = uint(RAYS)"),
}


def draws_everywhere(ctx: moderngl.Context, folder: Path) -> Rehearsal:
    """Programs that list every tile."""
    shutil.copytree(data_dir("glsl"), folder)
    for file, (condition, always) in EVERYWHERE.items():
        text = (folder / file).read_text()
        assert text.count(condition) == 1
        (folder / file).write_text(text.replace(condition, always))
    rehearsal = Rehearsal(ctx)
    rehearsal.programs = Programs(ctx, folder)
    return rehearsal


@pytest.mark.parametrize("name", ["still-life", "toy-train", "stress:near-lens"])
def test_whole_frames_are_the_same_as_without_lists(ctx: moderngl.Context, name: str, tmp_path: Path) -> None:
    """A flight that comes to rest, objects that move, and a change of focus."""
    stage, rehearsal = opened(ctx, name), draws_everywhere(ctx, tmp_path / "glsl")
    scene, settings = stage.renderer.scene, stage.settings
    whole, listing = Renderer(ctx, scene, (201, 117), rehearsal=rehearsal), Renderer(ctx, scene, (201, 117))
    for index in range(7):
        if index == 6:
            settings = put(settings, "lens.focus_distance", 1.5 * settings.lens.focus_distance)
        for renderer in (whole, listing):
            camera = stage.camera.moved(0.02 * min(index, 3), 0.0, 0.0)
            renderer.draw("hybrid", camera, settings, time_s=0.04 * min(index, 4))
        assert listing.plan is not None
        for target in sorted({t for call in listing.plan.calls for t in call.writes} - GUIDES):
            np.testing.assert_array_equal(listing.read(target), whole.read(target), err_msg=f"{target}, frame {index}")
    for held in (whole, listing, rehearsal):
        held.release()


def test_the_classes_are_numbered_as_in_the_shader() -> None:
    found = re.findall(r"(?:const uint|#define) (\w+) =? ?(\d+)u?;?", load_glsl()["dof/ray_tiles.glsl"])
    assert {name: int(value) for name, value in found} == {"NO_RAYS": NO_RAYS, "RAYS": RAYS, "CLASSES": RAY_CLASSES}


def test_what_is_drawn_in_part_is_cleared() -> None:
    """A pass over listed tiles leaves the others' texels as they were, unless its kernels cover every class."""
    for step in PASSES.values():
        whole = step.over and len(step.kernels(Settings(), ALL)) == BUFFERS[step.over].header // KERNEL_BYTES > 1
        if step.over and not whole:
            assert all(TARGETS[name].cleared for name in step.writes), step.name
