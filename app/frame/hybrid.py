"""Stages 5 to 10: rays where the raster image lacks what the lens sees, and the composite (Tan et al. 2020)."""

from __future__ import annotations

from ..optics import IN_FOCUS_COC_PX
from ..scene.facts import Facts
from ..settings import Settings
from .post import blurred, lens_defines
from .raster import moving, object_defines, shading_defines
from .records import Defines, Need, Pass

RECONSTRUCT_RINGS = 3  # 49 taps: at the largest radius two texels apart
RAYS_BEGIN_PX = 2.0  # CoC radius from which rays gain on the post-process: glsl/lib/mask.glsl


def partly_occluded(settings: Settings, facts: Facts) -> Need:
    """Rays: only if something can be in front of focus, blurred enough to be seen through."""
    if not (blur := blurred(settings, facts)).runs:
        return blur
    if facts.near_coc_px <= IN_FOCUS_COC_PX:
        return Need(False, "nothing is nearer than the focus zone, so nothing blurred can be seen through")
    if facts.near_coc_px <= RAYS_BEGIN_PX:
        return Need(
            False, f"near blur stays below {RAYS_BEGIN_PX:g} px, which the post-process gathers at full resolution"
        )
    return Need(True, f"near circles of confusion reach {facts.near_coc_px:.0f} px in radius")


def trace_defines(settings: Settings, facts: Facts) -> Defines:
    """The lens, the shading of ray hits, and whether they may have moved."""
    return (
        *lens_defines(settings, facts),
        *shading_defines(settings, facts),
        *object_defines(settings, facts),
    )


def reconstruct_defines(settings: Settings, facts: Facts) -> Defines:
    """The kernel's size."""
    return (("RINGS", RECONSTRUCT_RINGS),)


def settle_defines(settings: Settings, facts: Facts) -> Defines:
    """Whether pixels get no more rays once no display shows their noise."""
    return (("SETTLE", int(settings.mask.settle)),)


def smoothed(settings: Settings, facts: Facts) -> Need:
    """Spatial reconstruction: where there are rays, unless it is switched off."""
    if not settings.reconstruct.spatial:
        return Need(False, "reconstruct.spatial is off")
    return partly_occluded(settings, facts)


def edged(settings: Settings, facts: Facts) -> Need:
    """Edges: only where rays can be called for, and not where they go everywhere anyway."""
    if not settings.mask.edges:
        return Need(False, "mask.edges is off: rays go everywhere")
    return partly_occluded(settings, facts)


def scouting(settings: Settings, facts: Facts) -> Need:
    """Scouts: beside edges, unless they are switched off."""
    return edged(settings, facts) if settings.mask.scouts else Need(False, "mask.scouts is off")


def keeps_probes(settings: Settings, facts: Facts) -> bool:
    """Whether rays are stored for the next frame: always, since none can be fetched once something moves."""
    return settings.reconstruct.gradients and settings.reconstruct.temporal


def changing(settings: Settings, facts: Facts) -> Need:
    """Gradients: only where there are rays, and while something moves."""
    if not keeps_probes(settings, facts):
        return Need(False, "reconstruct.gradients or reconstruct.temporal is off")
    rays = partly_occluded(settings, facts)
    return moving(settings, facts) if rays.runs else rays


def accumulate_defines(settings: Settings, facts: Facts) -> Defines:
    """Which steps of the accumulation are on; whether whole frames are averaged after it."""
    steps = settings.reconstruct
    return (
        ("AVERAGED", int(settings.temporal.antialias)),
        ("TEMPORAL", int(steps.temporal)),
        ("MOTION", int(steps.motion)),
        ("REJECTION", int(steps.rejection)),
    )


ONE_GROUP = (1 << 16, 1 << 16)  # a work group that covers every picture: the pass runs once

MASKING = (
    Pass(
        "scout",
        "rays/scout.comp",
        reads=("depth",),
        history=("scout",),
        writes=("scout",),
        scene=True,
        rays=True,
        needed=scouting,
        defines=trace_defines,
    ),
    Pass(
        "mask_guide",
        "dof/mask_guide.comp",
        reads=("normal", "coc"),
        writes=("mask_guide", "mask_slope"),
        needed=edged,
    ),
    Pass(
        "mask_smooth_rows",
        "dof/mask_smooth.comp",
        reads=("guide=mask_guide",),
        writes=("mask_smooth_row",),
        defines=lambda s, f: (("AXIS", 0),),
        needed=edged,
    ),
    Pass(
        "mask_smooth_columns",
        "dof/mask_smooth.comp",
        reads=("guide=mask_smooth_row",),
        writes=("mask_smooth",),
        defines=lambda s, f: (("AXIS", 1),),
        needed=edged,
    ),
    Pass(
        "mask_edges",
        "dof/mask_edges.comp",
        reads=("mask_smooth", "mask_slope", "tiles"),
        writes=("mask_edges", "mask_tiles"),
        fills=("MaskReach",),
        needed=edged,
    ),
    Pass(
        "reach_rows",
        "dof/mask_reach.comp",
        reads=("reach=mask_tiles",),
        writes=("mask_reach_row",),
        defines=lambda s, f: (("AXIS", 0),),
        needed=edged,
    ),
    Pass(
        "reach_columns",
        "dof/mask_reach.comp",
        reads=("reach=mask_reach_row",),
        writes=("mask_reach",),
        defines=lambda s, f: (("AXIS", 1),),
        needed=edged,
    ),
    Pass(
        "mask_coarse",
        "dof/mask_coarse.comp",
        reads=("mask_edges",),
        buffers=("MaskReach",),
        writes=("mask_coarse",),
        needed=edged,
    ),
    Pass(
        "mask_rows",
        "dof/mask_rows.comp",
        reads=("mask_coarse", "mask_reach"),
        buffers=("MaskReach",),
        writes=("mask_rows",),
        needed=edged,
    ),
    Pass(
        "mask",
        "dof/mask.comp",
        optional=("mask_rows", "mask_reach", "motion", "scout"),
        history=("layer_state", "layer_moments"),
        writes=("mask",),
        fills=("RayHistogram",),
        needed=partly_occluded,
        defines=settle_defines,
    ),
)

TRACING = (
    Pass(
        "ray_budget",
        "dof/ray_budget.comp",
        buffers=("RayHistogram",),
        fills=("RayBudget",),
        grid="mask",
        group=ONE_GROUP,
        needed=partly_occluded,
    ),
    Pass(
        "ray_list",
        "dof/ray_list.comp",
        reads=("mask",),
        history=("ray_count",),
        buffers=("RayBudget",),
        writes=("ray_count",),
        fills=("RayWork",),
        needed=partly_occluded,
    ),
    Pass(
        "trace",
        "rays/trace.comp",
        reads=("ray_count",),
        buffers=("RayWork",),
        writes=("trace_near", "trace_far", "trace_motion", "trace_spread", "trace_moments"),
        writes_if=(("probe_hit", keeps_probes), ("probe_lens", keeps_probes)),
        indirect=("RayWork", 0),
        scene=True,
        rays=True,
        needed=partly_occluded,
        defines=trace_defines,
    ),
    Pass(
        "gradient",
        "rays/gradient.comp",
        reads=("trace_motion", "trace_near", "trace_far", "ray_count"),
        history=("probe_hit", "probe_lens"),
        writes=("gradient",),
        scene=True,
        rays=True,
        needed=changing,
        defines=trace_defines,
    ),
    Pass(
        "accumulate",
        "rays/accumulate.comp",
        reads=("trace_near", "trace_far", "trace_motion", "trace_spread", "trace_moments", "ray_count", "mask"),
        optional=("gradient",),
        history=("near_layer", "far_layer", "layer_state", "layer_coc", "layer_moments"),
        writes=("near_layer", "far_layer", "layer_state", "layer_coc", "layer_moments", "near_light", "far_light"),
        needed=partly_occluded,
        defines=accumulate_defines,
    ),
    Pass(
        "smoothing",
        "rays/smoothing.comp",
        reads=("layer_state", "layer_coc", "layer_moments", "kernel"),
        writes=("layer_smoothing",),
        needed=smoothed,
        defines=reconstruct_defines,
    ),
    Pass(
        "reconstruct",
        "rays/reconstruct.comp",
        reads=("near_light", "far_light", "layer_state", "layer_coc", "layer_smoothing", "kernel"),
        writes=("near_smooth", "far_smooth"),
        needed=smoothed,
        defines=reconstruct_defines,
    ),
    Pass(
        "composite",
        "dof/composite.comp",
        reads=("coc", "post", "post_behind", "far_blur", "mask", "near_light", "far_light", "layer_state"),
        optional=("near_smooth", "far_smooth"),
        writes=("hybrid",),
        needed=partly_occluded,
        defines=lambda s, f: (("RASTER_FOCUS", int(s.blend.raster)),),
    ),
)

HYBRID = (*MASKING, *TRACING)
