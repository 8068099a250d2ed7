"""Stage 5: the ray mask, where the raster image lacks what the lens sees (Tan et al. 2020, 2.1)."""

from __future__ import annotations

from ..optics import IN_FOCUS_COC_PX
from ..scene.facts import Facts
from ..settings import Settings
from .post import blurred, lens_defines
from .raster import object_defines, shading_defines
from .records import Defines, Kernels, Need, Pass
from .targets import RAY_CLASSES

RAYS_BEGIN_PX = 2.0  # CoC radius from which rays gain on the post-process: glsl/lib/mask.glsl
TILES_A_GROUP = (64, 64)  # half-res px that a work group of 8x8 tiles covers
NO_RAYS, RAYS = range(RAY_CLASSES)  # classes of tiles, as glsl/dof/ray_tiles.glsl numbers them


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


def edged(settings: Settings, facts: Facts) -> Need:
    """Edges: only where rays can be called for, and not where they go everywhere anyway."""
    if not settings.mask.edges:
        return Need(False, "mask.edges is off: rays go everywhere")
    return partly_occluded(settings, facts)


def scouting(settings: Settings, facts: Facts) -> Need:
    """Scouts: beside edges, unless they are switched off."""
    return edged(settings, facts) if settings.mask.scouts else Need(False, "mask.scouts is off")


def trace_defines(settings: Settings, facts: Facts) -> Defines:
    """The lens, the shading of ray hits, and whether they may have moved."""
    return (
        *lens_defines(settings, facts),
        *shading_defines(settings, facts),
        *object_defines(settings, facts),
    )


def settle_defines(settings: Settings, facts: Facts) -> Defines:
    """Whether pixels get no more rays once no display shows their noise."""
    return (("SETTLE", int(settings.mask.settle)),)


def ray_kernels(settings: Settings, facts: Facts) -> Kernels:
    """One kernel, over the tiles where rays may be called for."""
    return ((RAYS, (("TILE_CLASS", RAYS),)),)


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
        "edge_tiles",
        "dof/edge_tiles.comp",
        reads=("tiles",),
        fills=("EdgeTiles",),
        grid="tiles",
        needed=edged,
    ),
    Pass(
        "mask_guide",
        "dof/mask_guide.comp",
        reads=("normal", "coc"),
        writes=("mask_guide", "mask_slope"),
        needed=edged,
        over="EdgeTiles",
    ),
    Pass(
        "mask_smooth_rows",
        "dof/mask_smooth.comp",
        reads=("guide=mask_guide",),
        writes=("mask_smooth_row",),
        defines=lambda s, f: (("AXIS", 0),),
        needed=edged,
        over="EdgeTiles",
    ),
    Pass(
        "mask_smooth_columns",
        "dof/mask_smooth.comp",
        reads=("guide=mask_smooth_row",),
        writes=("mask_smooth",),
        defines=lambda s, f: (("AXIS", 1),),
        needed=edged,
        over="EdgeTiles",
    ),
    Pass(
        "mask_edges",
        "dof/mask_edges.comp",
        reads=("mask_smooth", "mask_slope"),
        writes=("mask_edges", "mask_tiles"),
        fills=("MaskReach",),
        needed=edged,
        over="EdgeTiles",
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
        "ray_tiles",
        "dof/ray_tiles.comp",
        optional=("mask_reach", "scout"),
        fills=("RayTiles",),
        grid="mask",
        group=TILES_A_GROUP,
        needed=partly_occluded,
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
        over="RayTiles",
        kernels=ray_kernels,
    ),
)
