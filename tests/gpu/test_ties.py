"""Surfaces at the very same distance: rays show the one drawn first, as GL_LESS does, however the tree was built."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from app.bvh import build
from app.camera import look_at
from app.frame.pipeline import VIEWS
from app.scene.model import Material, Scene, TextureSlot
from tests.image.stage import stage_of

from .rays import Mesh
from .small_scenes import checker, moving, quad, scene_of
from .test_traverse import as_float32, nasty_corners

SOURCES = 120  # triangles that are repeated ...
COPIES = 12  # ... this often: more than a leaf holds, so that ties span leaves
TURNS = np.array([(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)])  # every way to begin and to wind


def repeated(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """(corners of shuffled copies (m, 3, 3), which source each is of (m,)): each begun and wound in any way."""
    sources = nasty_corners(rng)
    sources = sources[rng.choice(len(sources), SOURCES, replace=False)]
    source = rng.permutation(np.repeat(np.arange(SOURCES), COPIES))
    turn = TURNS[rng.integers(0, len(TURNS), len(source))]
    return np.take_along_axis(sources[source], turn[:, :, None], axis=1), source


def test_of_coincident_triangles_the_first_drawn_is_hit(ctx: moderngl.Context) -> None:
    """At bitwise equal distances, whatever corner each copy begins with and however it is wound."""
    rng = np.random.default_rng(11)
    corners, source = repeated(rng)
    first = np.array([np.flatnonzero(source == k)[0] for k in range(SOURCES)])
    weights = rng.dirichlet([1, 1, 1], 50_000)
    weights[:20_000, 2] = 0  # on edges
    weights /= weights.sum(axis=1, keepdims=True)
    targets = np.einsum("ri,rij->rj", weights, corners[rng.integers(0, len(corners), len(weights))])
    origins = rng.uniform(-5, 5, targets.shape)
    origins, directions = as_float32(origins, targets - origins)
    mesh = Mesh.of(ctx, corners)
    result = mesh.trace(origins, directions)
    assert result.hit.mean() > 0.8  # what has no area is not there
    hit = result.triangle[result.hit]
    np.testing.assert_array_equal(hit, first[source[hit]])
    mesh.release()


def test_the_answer_does_not_depend_on_the_tree(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same triangles in another order, each told when it is drawn, in another tree: the same hits."""
    rng = np.random.default_rng(12)
    corners, _ = repeated(rng)
    shuffled = rng.permutation(len(corners))
    targets = corners[rng.integers(0, len(corners), 50_000)].mean(axis=1)
    origins = rng.uniform(-5, 5, targets.shape)
    rays = as_float32(origins, targets - origins)
    one = Mesh.of(ctx, corners)
    monkeypatch.setattr(build, "LEAF_SIZE", 1)
    monkeypatch.setattr(build, "MAX_DEPTH", 12)  # cuts in the middle
    other = Mesh.of(ctx, corners[shuffled], drawn=shuffled)
    assert len(one.bvh.nodes) != len(other.bvh.nodes)
    a, b = one.trace(*rays), other.trace(*rays)
    np.testing.assert_array_equal(a.hit, b.hit)
    np.testing.assert_array_equal(a.t[a.hit], b.t[b.hit])
    np.testing.assert_array_equal(a.triangle[a.hit], shuffled[b.triangle[b.hit]])
    one.release()
    other.release()


RED, GREEN, BLUE = (Material(base_color=(*c, 1.0)) for c in np.eye(3))
SHEET = ((-2.0, -2.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0))


def sheets(order: str) -> Scene:
    """Three equal quads in one place; "masked": the first has an alpha mask, and is drawn last."""
    materials = {"red first": (RED, GREEN, BLUE), "blue first": (BLUE, GREEN, RED)}.get(order, (BLUE, RED, GREEN))
    scene = scene_of([quad(*SHEET, material=i) for i in range(3)], materials)
    if order == "moving":  # objects come after what stands still
        return moving(scene, 0)
    if order == "masked":
        solid = replace(materials[0], alpha_cutoff=0.5, base_color_texture=TextureSlot(0))
        return replace(scene, materials=(solid, *materials[1:]), images=(checker(4, 255, 255),))
    return scene


@pytest.mark.parametrize(("order", "channel"), [("red first", 0), ("blue first", 2), ("masked", 0), ("moving", 0)])
def test_raster_and_rays_show_the_same_of_coincident_sheets(ctx: moderngl.Context, order: str, channel: int) -> None:
    camera = look_at((0.1, 0.2, 3.0), (0.0, 0.0, 0.0))
    stage = stage_of(ctx, sheets(order), camera, shading__mode="unlit", lens__aperture=0.02)
    assert {"sharp", "traced"} <= set(VIEWS)
    for view in ("sharp", "traced"):
        picture = stage.draw(view, (32, 32), spp=4).linear()
        np.testing.assert_array_equal(np.argmax(picture, axis=2), channel)
        np.testing.assert_allclose(picture.sum(axis=2), 1.0, atol=2**-10)
    stage.renderer.scene.release()
    stage.renderer.release()
