"""One bad texel stays one: written into any target right after its pass, it reaches no other target, and is counted."""

from __future__ import annotations

import re
from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from app.bvh.build import build_bvh
from app.camera import Camera, look_at
from app.frame.pipeline import frame_plan
from app.frame.targets import TARGETS
from app.gpu.health import BadTexels
from app.gpu.scene import GpuScene
from app.gpu.shaders import load_glsl
from app.optics import SKY_DEPTH
from app.scene.facts import Facts
from app.scene.flatten import flatten
from app.scene.model import Light, Material
from app.settings import Settings, put

from .poison import Poison, PoisonedRenderer
from .small_scenes import quad, scene_of

SIZE = (64, 48)
LENS = put(put(Settings(), "lens.aperture", 0.15), "lens.focus_distance", 3.0)
STILL = [look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))] * 4
MOVING = [look_at((0.01 * i, 0.0, 0.0), (0.01 * i, 0.0, -1.0)) for i in range(4)]
WALKS = {"still": STILL, "moving": MOVING}
FACTS = Facts(near_coc_px=30.0, far_coc_px=30.0, emissive=True, lights=1, sun=True)
MADE = {
    walk: [
        target
        for call in frame_plan("hybrid", LENS, Facts(**{**vars(FACTS), "camera_moved": walk == "moving"})).calls
        for target in call.writes
        if TARGETS[target].dtype != "f1"
    ]
    for walk in WALKS
}

# The table of the aperture's points is made from three numbers of the lens.
UNGUARDED = ("kernel",)
# Fetched between texels, where the hardware mixes before a guard can look: they count as nothing in that footprint.
INTERPOLATED = ("near_blur", "far_blur", "near_specular", "mask")


@pytest.fixture(scope="module")
def renderer(ctx: moderngl.Context) -> Iterator[PoisonedRenderer]:
    """A shining edge near the lens, a square in focus and a wall behind, lit."""
    meshes = [
        quad((-50.0, -50.0, -1.0), (50.0, 0.0, 0.0), (0.0, 100.0, 0.0), 0),
        quad((-50.0, -50.0, -6.0), (100.0, 0.0, 0.0), (0.0, 100.0, 0.0), 1),
        quad((0.0, -1.0, -3.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0),
    ]
    materials = [Material(base_color=(0.8, 0.1, 0.1, 1.0), emissive=(0.1, 0.1, 0.1)), Material((0.1, 0.6, 0.1, 1.0))]
    scene = scene_of(meshes, materials, lights=[Light("sun", (1.0, 1.0, 1.0), 3.0, direction=(0.0, -0.6, -0.8))])
    triangles = flatten(scene)
    gpu = GpuScene(ctx, scene, triangles, lambda progress: build_bvh(triangles.positions, triangles.indices))
    renderer = PoisonedRenderer(ctx, gpu, SIZE)
    renderer.health.watched = "all"
    yield renderer
    renderer.release()
    gpu.release()


def poisoned(renderer: PoisonedRenderer, cameras: list[Camera], poison: Poison | None) -> dict[str, np.ndarray]:
    """Every target of the third frame, into which the poison went."""
    renderer.reset()
    for camera in cameras[:2]:
        renderer.draw("hybrid", camera, LENS)
    renderer.poison = poison
    renderer.draw("hybrid", cameras[2], LENS)
    renderer.poison = None
    assert renderer.plan is not None
    return {t: renderer.read(t) for call in renderer.plan.calls for t in call.writes}


def middle(target: str, value: float) -> Poison:
    """In the middle of the picture, where all layers meet."""
    width, height = TARGETS[target].fixed or (-(-side // TARGETS[target].scale) for side in SIZE)
    return Poison(target, width // 2, height // 2, value)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1e4], ids=str)
@pytest.mark.parametrize(
    ("walk", "target"),
    [("still", t) for t in MADE["still"] if t not in UNGUARDED]
    + [("moving", t) for t in ("motion", "gradient", "near_layer", "resolved")],
)
def test_a_bad_texel_reaches_no_other_target_and_is_counted(
    renderer: PoisonedRenderer, walk: str, target: str, value: float
) -> None:
    poison = middle(target, value)
    made = poisoned(renderer, WALKS[walk], poison)
    found = renderer.health.finish()
    for name, texels in made.items():
        texels = texels.astype(np.float64)
        if name == target:
            texels[poison.y, poison.x] = 0.0
        assert np.isfinite(texels).all(), f"{name}: {np.count_nonzero(~np.isfinite(texels))} after {target}"
        light = texels[..., [i for i in range(texels.shape[-1]) if "xyzw"[i] not in TARGETS[name].signed]]
        assert light.min(initial=0.0) >= 0.0, f"{name}: {light.min()} after {target}"
    unsigned = len(TARGETS[target].signed) < TARGETS[target].components
    expected = BadTexels(non_finite=1) if not np.isfinite(value) else BadTexels(negative=int(unsigned))
    assert {name: bad for name, bad in found.items() if bad} == ({target: expected} if expected else {})
    for camera in WALKS[walk][2:]:  # and is gone with the frames that keep it
        renderer.draw("hybrid", camera, LENS)
    assert np.isfinite(renderer.linear()).all()


@pytest.mark.parametrize("target", [t for t in MADE["still"] if t not in (*UNGUARDED, *INTERPOLATED, "hybrid")])
def test_what_is_no_number_counts_as_the_nothing_that_stands_for_it(renderer: PoisonedRenderer, target: str) -> None:
    """Bit by bit, in the picture: as if 0 had been written, or the sky's depth."""
    nothing = poisoned(renderer, STILL, middle(target, SKY_DEPTH if target == "depth" else 0.0))["hybrid"]
    for value in (np.nan, -np.inf):
        assert np.array_equal(poisoned(renderer, STILL, middle(target, value))["hybrid"], nothing), value


def test_passes_fetch_through_the_guards() -> None:
    """Textures of the scene, which files cannot fill with what is no number, are read as they are."""
    bare = re.compile(r"\b(?:texelFetch|textureLod)\(\s*(\w+)")
    guarded = re.compile(r"finite(?:_radiance)?\(\s*(?:texelFetch|textureLod)\(")
    ours = ("in_kernel", "records", "scene_shadow")
    for name, text in load_glsl().items():
        if not name.startswith(("dof/", "rays/", "output/", "raster/")) or name in ("output/show.comp",):
            continue  # the target viewer shows what is there
        for match in bare.finditer(guarded.sub("", text)):
            sampler = match[1]
            if not sampler.startswith("scene_") and sampler not in ours:
                # History between texels: a pixel that meets what is no number starts afresh.
                assert (name, sampler) == ("output/resolve.comp", "prev_resolved"), "read unguarded"
