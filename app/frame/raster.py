"""Stage 1 and 2: the G-buffer, the lighting, and the circle of confusion of what was rasterised."""

from __future__ import annotations

from dataclasses import replace

from ..scene.facts import Facts
from ..settings import Settings, ShadingMode
from .records import Defines, Need, Pass


def lit(settings: Settings) -> bool:
    """True unless surfaces show their base colour only."""
    return settings.shading.mode is ShadingMode.LIT


def shading_defines(settings: Settings, facts: Facts) -> Defines:
    """The permutation of `shade()`: the same for the raster image and for ray hits, so that views differ in depth of
    field only.
    """
    light = lit(settings)
    return (
        ("LIT", int(light)),
        ("TEXTURED", int(facts.textured)),
        ("NORMAL_MAPPED", int(facts.normal_mapped and light)),
        ("EMISSIVE", int(facts.emissive)),
        ("ALPHA_MASKED", int(facts.alpha_masked)),
        ("POINT_LIGHTS", int(facts.lights > int(facts.sun) and light)),
        ("SUN", int(facts.sun and light)),
        ("SHADOWS", int(facts.sun and settings.shading.shadows and light)),
    )


def moving(settings: Settings, facts: Facts) -> Need:
    """Motion vectors: only while something moves on screen."""
    movers = ("the camera moves",) * facts.camera_moved + ("objects move",) * facts.objects_moved
    return Need(bool(movers), " and ".join(movers) or "nothing moves")


def object_defines(settings: Settings, facts: Facts) -> Defines:
    """Whether vertices and rays must ask where an object is now (glsl/shared/objects.glsl)."""
    return (("OBJECTS", int(facts.objects)),)


def gbuffer_defines(settings: Settings, facts: Facts) -> Defines:
    """What the surfaces in view are made of, where they are, and how their depths are told apart."""
    seen = replace(facts, normal_mapped=facts.normal_mapped_in_view, alpha_masked=facts.alpha_masked_in_view)
    return (*shading_defines(settings, seen), *object_defines(settings, facts), ("LOG_DEPTH", int(facts.deep)))


RASTER = (
    Pass(
        "gbuffer",
        "raster/gbuffer",
        kind="raster",
        scene=True,
        writes=("base_color", "normal", "depth"),
        writes_if=(
            ("emissive", lambda settings, facts: facts.emissive),
            ("object", lambda settings, facts: facts.objects),
        ),
        defines=gbuffer_defines,
    ),
    Pass(
        "motion",
        "raster/motion.comp",
        reads=("depth",),
        optional=("object",),
        writes=("motion",),
        scene=True,
        needed=moving,
        defines=object_defines,
    ),
    Pass(
        "lighting",
        "raster/lighting.comp",
        reads=("base_color", "normal", "depth"),
        optional=("emissive",),
        writes=("lit",),
        scene=True,
        defines=shading_defines,
    ),
    Pass("coc", "dof/coc.comp", reads=("depth",), writes=("coc",)),
)
