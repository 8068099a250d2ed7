"""References are drawn once, kept under all that matters to them, and know what the lens sees."""

from __future__ import annotations

import math
import shutil
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.camera import Moment
from app.errors import UserError
from app.measure import reference as made
from app.measure import store
from app.measure.regions import BOTH_SIDES
from app.measure.store import reference_key, scene_digest
from app.optics import IN_FOCUS_COC_PX, coc_scale_px
from app.settings import put

from ..gpu.small_scenes import moving as moving_scene
from ..gpu.small_scenes import quad, scene_of
from . import scores
from .half_plane import CAMERA, NEAR, RADIUS_PX, SIZE, covered, half_plane
from .references import reference


def test_the_region_that_sees_both_sides_is_known_in_closed_form(ctx, cached: Path) -> None:
    spp = 512
    truth = reference(ctx, half_plane(ctx), "half-plane", SIZE, spp)
    # Of spp evenly spread lens points, the edge leaves about sqrt(spp) undecided, by half a point each; and a pixel
    # averages over its own width, in which the share bends by at most the square of that width over the blur's.
    tolerance = 0.5 / math.sqrt(spp) + 0.5 / (2 * RADIUS_PX) ** 2
    np.testing.assert_allclose(truth.near, covered(), atol=tolerance)
    low, high = BOTH_SIDES
    share = covered()
    sure = (np.abs(share - low) > low / 2) & (np.abs(share - high) > low / 2)
    expected = (share > low) & (share < high)
    both_sides = truth.regions["near_silhouettes"]
    assert (both_sides == expected)[sure].all()
    assert sure.mean() > 0.8
    assert 0.2 < both_sides.mean() < 0.8
    assert (truth.regions["far_blur"] == (share <= low))[sure].all()  # the sky; and nothing is in focus
    np.testing.assert_allclose(truth.near + truth.far, 1.0, atol=1e-6)


def test_what_is_in_focus_or_behind_it_has_no_two_sides(ctx, cached: Path) -> None:
    stage = half_plane(ctx)
    scale = coc_scale_px(stage.settings.lens.aperture, SIZE[1], CAMERA.fov_y)
    inverse = 1.0 / NEAR - 0.9 * IN_FOCUS_COC_PX / scale  # the half-plane lies just within the focus zone
    stage = replace(stage, settings=put(stage.settings, "lens.focus_distance", 1.0 / inverse))
    truth = reference(ctx, stage, "half-plane", SIZE, 8)
    assert not truth.near.any()
    still = scores.scored(ctx, stage, "sharp", SIZE, 1, truth)
    assert still.error.whole > 0.0
    assert math.isnan(still.error.both_sides)


def test_a_reference_is_drawn_once(ctx, cached: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = half_plane(ctx)
    first = reference(ctx, stage, "half-plane", SIZE, 4)
    monkeypatch.setattr(made, "drawing", lambda *_, **__: pytest.fail("drawn again"))
    again = reference(ctx, stage, "half-plane", SIZE, 4)
    np.testing.assert_array_equal(first.halves, again.halves)
    assert len(list(cached.iterdir())) == 1


def test_a_reference_is_kept_under_all_that_matters_to_it(ctx, monkeypatch: pytest.MonkeyPatch) -> None:
    settings, here = half_plane(ctx).settings, Moment(CAMERA, 0.0)

    def named(device="gpu", scene="a", view="reference", size=SIZE, spp=4, moment=here, **changed: object) -> str:
        used = settings
        for path, value in changed.items():
            used = put(used, path.replace("__", "."), value)
        return reference_key(device, scene, view, size, spp, moment, used)

    assert named() == named(mask__sensitivity=3.0, reconstruct__temporal=False, shading__exposure=1.0)
    others = [
        named(device="another"),
        named(scene="b"),
        named(view="traced"),
        named(size=(36, 64)),
        named(spp=8),
        named(moment=Moment(CAMERA, 1.0)),
        named(moment=Moment(CAMERA.moved(0.01, 0.0, 0.0), 0.0)),
        named(lens__aperture=0.123),
        named(shading__background=(0.1, 0.2, 0.3)),
    ]
    monkeypatch.setattr(store, "sources_digest", lambda view: "changed")
    names = [*others, named()]
    monkeypatch.undo()
    assert len({named(), *names}) == len(names) + 1


def test_every_named_source_exists() -> None:
    for patterns in store.SOURCES.values():
        assert all(list(store.PACKAGE.glob(pattern)) for pattern in patterns)
    assert len({store.sources_digest(view) for view in made.VIEWS}) == len(made.VIEWS)


def test_a_scene_is_told_by_its_values_alone() -> None:
    scene = scene_of([quad((0, 0, -1), (1, 0, 0), (0, 1, 0))])
    assert scene_digest(scene) == scene_digest(replace(scene, report=replace(scene.report, seconds=9.0)))
    moved = scene_of([quad((0, 0, -1.0001), (1, 0, 0), (0, 1, 0))])
    painted = replace(scene, materials=(replace(scene.materials[0], metallic=0.5),))
    played = moving_scene(scene, 0, slide=((0, 0, 0), (1, 0, 0)))
    assert len({scene_digest(s) for s in (scene, moved, painted, played)}) == 4


def test_a_reference_that_cannot_be_kept_is_drawn_all_the_same(ctx, cached: Path) -> None:
    stage = half_plane(ctx)
    kept = reference(ctx, stage, "half-plane", SIZE, 4)
    file = next(cached.iterdir())
    file.write_bytes(file.read_bytes()[:-100])
    again = reference(ctx, stage, "half-plane", SIZE, 4)
    np.testing.assert_array_equal(kept.halves, again.halves)
    assert "unreadable" in again.notes[0]
    shutil.rmtree(cached)
    cached.write_text("no folder")
    last = reference(ctx, stage, "half-plane", SIZE, 4)
    assert "could not be kept" in last.notes[-1]
    np.testing.assert_array_equal(kept.halves, last.halves)


def test_old_references_go_first(ctx, cached: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = half_plane(ctx)
    for spp in (2, 4, 6):
        reference(ctx, stage, "half-plane", SIZE, spp)
        monkeypatch.setattr(store, "SIZE_LIMIT", int(2.5 * next(cached.iterdir()).stat().st_size))
    assert len(list(cached.iterdir())) == 2


def test_a_traced_reference_tells_the_same_regions(ctx) -> None:
    stage = half_plane(ctx)
    stage.renderer.resize(SIZE)
    stage.renderer.seed = 5
    both = [run(made.drawing(stage.renderer, CAMERA, stage.settings, 256, view=view)) for view in made.VIEWS]
    assert (both[0].labels == both[1].labels).mean() > 0.99  # 256 lens points each, of other seeds for half of them
    # Each is off by its floor from the truth, both by the sum of the squares from each other; rmse is known to a part
    # 1 / sqrt(2 n) of it for n independent errors, of which half a lens' points share one.
    apart = both[0].errors(both[1].halves.mean(0), flip=False)["whole"].rmse
    assert apart < 1.5 * math.hypot(*(truth.floor["whole"].rmse for truth in both))
    assert stage.renderer.seed == 5


def run(steps: Generator[float, None, made.Reference]) -> made.Reference:
    """What a drawing returns, after checking that it says how far it is."""
    parts = []
    while True:
        try:
            parts.append(next(steps))
        except StopIteration as end:
            assert parts == sorted(parts)
            assert parts[-1] == 1.0
            return end.value


@pytest.mark.parametrize(("view", "spp"), [("reference", 3), ("reference", 0), ("hybrid", 4)])
def test_what_is_no_reference_is_refused(ctx, cached: Path, view: str, spp: int) -> None:
    stage = half_plane(ctx)
    with pytest.raises(UserError, match=r"choose one of|even number"):
        made.reference(ctx, stage.renderer, CAMERA, stage.settings, spp, scene="x", view=view, folder=cached)
