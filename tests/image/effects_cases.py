"""Scenes and lenses that call for more and for less, and frames that should cost the same, or less."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import moderngl

from app.scene.load import load_scene
from app.scene.sight import sight
from app.session import focused, viewpoints
from app.settings import Settings, put

from .stage import Stage, opened, stage_of
from .subjects import SUBJECTS

MASKED = 0.05  # share of the pixels that "5 % masked" aims at
SLOTS = ("base_color_texture", "metallic_roughness_texture", "normal_texture", "emissive_texture")
Change = Callable[[Stage], Settings]


def as_it_is(stage: Stage) -> Settings:
    """The subject's own settings."""
    return stage.settings


def changed(path: str, value: object, before: Change = as_it_is) -> Change:
    """One setting, after another change."""
    return lambda stage: put(before(stage), path, value)


def nothing_near(stage: Stage) -> Settings:
    """Focused before what is nearest."""
    scene, lens = stage.renderer.scene, stage.settings.lens
    seen = sight(scene.facts.boxes, stage.camera, lens, stage.renderer.size, scene.near_plane)
    return put(stage.settings, "lens.focus_distance", 0.9 * seen.nearest)


def little_masked(stage: Stage) -> Settings:
    """The aperture at which rays are called for in MASKED of the pixels, by bisection."""
    low, high, found = 0.0, stage.settings.lens.aperture, stage.settings
    for _ in range(10):
        middle = 0.5 * (low + high)
        found = put(stage.settings, "lens.aperture", middle)
        low, high = (middle, high) if masked(stage, found) < MASKED else (low, middle)
    return found


def masked(stage: Stage, settings: Settings) -> float:
    """Share of the half-resolution pixels that rays are called for in, after a few frames."""
    renderer = stage.draw("hybrid", stage.renderer.size, frames=4, settings=settings)
    assert renderer.plan is not None
    traces = any(call.step.name == "trace" for call in renderer.plan.calls)
    return float((renderer.read("mask")[..., 0] > 0.0).mean()) if traces else 0.0


PINHOLE, TINY = changed("lens.aperture", 0.0), changed("lens.aperture", 1e-4)


@dataclass(frozen=True)
class Case:
    """A column of the table of passes: a subject, and what is changed in its settings."""

    name: str
    subject: str
    change: Change = as_it_is


CASES = (
    Case("still-life", "still-life"),
    Case("pinhole", "still-life", PINHOLE),
    Case("all in focus", "still-life", TINY),
    Case("nothing near", "still-life", nothing_near),
    Case("unlit", "still-life", changed("shading.mode", "unlit")),
    Case("bare, unlit", "bare", changed("shading.mode", "unlit")),
    Case("toy-train", "toy-train"),
    Case("hedge", "stress:hedge"),
    Case("room", "room"),
    Case("plant", "plant"),
)


@dataclass(frozen=True)
class Side:
    """One of two frames that are compared."""

    subject: str
    view: str
    change: Change = as_it_is


@dataclass(frozen=True)
class Pair:
    """Two frames, the first of which should take no more than `most` of the second's time."""

    name: str
    first: Side
    second: Side
    most: float


LITTLE = Side("still-life", "hybrid", little_masked)
PAIRS = (
    Pair("pinhole, hybrid / sharp", Side("still-life", "hybrid", PINHOLE), Side("still-life", "sharp", PINHOLE), 1.05),
    Pair("pinhole, post / sharp", Side("still-life", "post", PINHOLE), Side("still-life", "sharp", PINHOLE), 1.05),
    Pair("all in focus, hybrid / sharp", Side("still-life", "hybrid", TINY), Side("still-life", "sharp", TINY), 1.1),
    Pair("nothing near, hybrid / post", Side("still-life", "hybrid", nothing_near),
         Side("still-life", "post", nothing_near), 1.05),
    Pair("still-life without lights and textures / with them, sharp",
         Side("bare", "sharp", changed("shading.mode", "unlit")), Side("still-life", "sharp"), 1.0),
    Pair("5 % masked, hybrid / the same with rays everywhere", LITTLE,
         Side("still-life", "hybrid", changed("mask.edges", False, little_masked)), 0.7),
    Pair("room, post / the same without tile classes", Side("room", "post"),
         Side("room", "post", changed("post.tile_classes", False)), 1 / 1.5),
    Pair("living room, post / the same without tile classes", Side("living", "post"),
         Side("living", "post", changed("post.tile_classes", False)), 1 / 1.5),
)  # fmt: skip


@cache
def stage_for(ctx: moderngl.Context, subject: str) -> Stage | None:
    """A subject, a built-in scene, or "bare": the still life without textures. None: not beside this checkout."""
    known = {s.name: s for s in SUBJECTS}
    if subject == "bare":
        return _bare(ctx)
    if subject not in known:
        return opened(ctx, subject)
    return known[subject].opened(ctx) if not known[subject].shared or known[subject].file.exists() else None


def _bare(ctx: moderngl.Context) -> Stage:
    scene = load_scene("still-life")
    materials = tuple(replace(material, **dict.fromkeys(SLOTS)) for material in scene.materials)
    bare = replace(scene, materials=materials, images=())
    whole = opened(ctx, "still-life")
    stage = stage_of(ctx, bare, whole.camera)
    return replace(stage, settings=focused(stage.settings, viewpoints(scene, (None, None))[0]))
