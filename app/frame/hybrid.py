"""Stages 6 to 10: rays where the mask calls for them, their layers, and the composite (Tan et al. 2020)."""

from __future__ import annotations

from ..scene.facts import Facts
from ..settings import Settings
from .mask import MASKING, NO_RAYS, partly_occluded, ray_kernels, trace_defines
from .raster import moving
from .records import Defines, Kernels, Need, Pass

RECONSTRUCT_RINGS = 3  # 49 taps: at the largest radius two texels apart


def reconstruct_defines(settings: Settings, facts: Facts) -> Defines:
    """The kernel's size."""
    return (("RINGS", RECONSTRUCT_RINGS),)


def smoothed(settings: Settings, facts: Facts) -> Need:
    """Spatial reconstruction: where there are rays, unless it is switched off."""
    if not settings.reconstruct.spatial:
        return Need(False, "reconstruct.spatial is off")
    return partly_occluded(settings, facts)


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


def composite_kernels(settings: Settings, facts: Facts) -> Kernels:
    """One kernel for tiles with rays and, unless rays go everywhere, one for those without."""
    without = ((NO_RAYS, (("TILE_CLASS", NO_RAYS),)),) if settings.mask.edges else ()
    return (*without, *ray_kernels(settings, facts))


ONE_GROUP = (1 << 16, 1 << 16)  # a work group that covers every picture: the pass runs once

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
        over="RayWork",
        writes=("trace_near", "trace_far", "trace_motion", "trace_spread", "trace_moments"),
        writes_if=(("probe_hit", keeps_probes), ("probe_lens", keeps_probes)),
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
        over="RayTiles",
        kernels=ray_kernels,
    ),
    Pass(
        "smoothing",
        "rays/smoothing.comp",
        reads=("layer_state", "layer_coc", "layer_moments", "kernel"),
        writes=("layer_smoothing",),
        needed=smoothed,
        defines=reconstruct_defines,
        over="RayTiles",
        kernels=ray_kernels,
    ),
    Pass(
        "reconstruct",
        "rays/reconstruct.comp",
        reads=("near_light", "far_light", "layer_state", "layer_coc", "layer_smoothing", "kernel"),
        writes=("near_smooth", "far_smooth"),
        needed=smoothed,
        defines=reconstruct_defines,
        over="RayTiles",
        kernels=ray_kernels,
    ),
    Pass(
        "composite",
        "dof/composite.comp",
        reads=("coc", "post", "post_behind", "far_blur", "mask", "near_light", "far_light", "layer_state"),
        optional=("near_smooth", "far_smooth"),
        writes=("hybrid",),
        needed=partly_occluded,
        defines=lambda s, f: (("RASTER_FOCUS", int(s.blend.raster)),),
        kernels=composite_kernels,
        over="RayTiles",
    ),
)

HYBRID = (*MASKING, *TRACING)
