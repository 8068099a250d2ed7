"""Stage 4: depth of field as a post-process, adapted from Jimenez 2014."""

from __future__ import annotations

from ..optics import IN_FOCUS_COC_PX
from ..scene.facts import Facts
from ..settings import Settings
from .raster import lit
from .records import Defines, Kernels, Need, Pass
from .targets import TILE_CLASSES

FULL_RES_PX = 2.0  # CoC radius up to which full resolution draws the blur: half a resolution's texel is as large
SHARP, SLIGHT, NEAR, FAR, MIXED = range(TILE_CLASSES)  # classes of tiles, as glsl/dof/tile_classes.glsl numbers them


def blurred(settings: Settings, facts: Facts) -> Need:
    """Any blur at all: only if a circle of confusion larger than the focus zone's can appear."""
    if settings.lens.aperture == 0.0:
        return Need(False, "the aperture is 0, a pinhole: everything is sharp")
    largest = max(facts.near_coc_px, facts.far_coc_px)
    if largest <= IN_FOCUS_COC_PX:
        return Need(False, f"the largest circle of confusion is {largest:.2f} px in radius, within the focus zone")
    return Need(True, f"circles of confusion reach {largest:.0f} px in radius")


def half_res_begins_px(settings: Settings) -> float:
    """CoC radius from which half resolution draws the blur (glsl/dof/layers.glsl)."""
    return FULL_RES_PX if settings.post.slight_focus else IN_FOCUS_COC_PX


def softened(settings: Settings, facts: Facts) -> Need:
    """Half resolution: only if there is more blur than full resolution draws."""
    blur, begin_px = blurred(settings, facts), half_res_begins_px(settings)
    if blur.runs and max(facts.near_coc_px, facts.far_coc_px) <= begin_px:
        return Need(False, f"blur stays below {begin_px:g} px, which full resolution draws")
    return blur


def has_near_layer(settings: Settings, facts: Facts) -> bool:
    """Whether anything before focus is blurred at half resolution, in front of all else."""
    return facts.near_coc_px > half_res_begins_px(settings)


def has_far_layer(settings: Settings, facts: Facts) -> bool:
    """Whether anything behind focus is blurred at half resolution."""
    return facts.far_coc_px > half_res_begins_px(settings)


def lens_defines(settings: Settings, facts: Facts) -> Defines:
    """Aperture shape, compiled in: a circle costs no trigonometry, and a lens without a barrel no test of it."""
    return (
        ("BLADES", settings.lens.blades if settings.lens.blades >= 3 else 0),
        ("CAT_EYE", int(settings.lens.cat_eye > 0.0)),
        ("ABERRATION", int(settings.lens.spherical_aberration != 0.0)),
    )


def gather_defines(settings: Settings, facts: Facts) -> Defines:
    """Kernel size beside the aperture shape."""
    return (*lens_defines(settings, facts), ("RINGS", settings.post.rings))


def layer_defines(settings: Settings, facts: Facts) -> Defines:
    """Beside those, where half resolution takes over: later if slight defocus has its own full-resolution gather."""
    return (*gather_defines(settings, facts), ("SLIGHT_FOCUS", int(settings.post.slight_focus)))


def tile_defines(settings: Settings, facts: Facts) -> Defines:
    """Whether tiles are told apart, where their classes meet, and which there can be."""
    return (
        ("TILE_CLASSES", int(settings.post.tile_classes)),
        ("SLIGHT_FOCUS", int(settings.post.slight_focus)),
        ("NEAR_LAYER", int(has_near_layer(settings, facts))),
        ("FAR_LAYER", int(has_far_layer(settings, facts))),
    )


def median_defines(settings: Settings, facts: Facts) -> Defines:
    """Whether the 3x3 median filters or just passes on."""
    return (("MEDIAN", int(settings.post.median)), ("RINGS", settings.post.rings))


def specular(settings: Settings, facts: Facts) -> bool:
    """Whether there is any specular light to keep apart, for highlights that a near layer spreads."""
    return lit(settings) and has_near_layer(settings, facts)


def tile_kernels(settings: Settings, facts: Facts) -> Kernels:
    """A kernel for each class of tiles that there can be; for all together where they are not told apart."""
    near, far = has_near_layer(settings, facts), has_far_layer(settings, facts)
    if not settings.post.tile_classes:
        return (_kernel(MIXED, 1, int(near), int(far)),)
    there = {SHARP: True, SLIGHT: settings.post.slight_focus, NEAR: near, FAR: far, MIXED: near and far}
    layers = {SHARP: (0, 0, 0), SLIGHT: (1, 0, 0), NEAR: (1, 1, 0), FAR: (1, 0, 1), MIXED: (1, 1, 1)}
    return tuple(_kernel(index, *layers[index]) for index, is_there in there.items() if is_there)


def _kernel(index: int, blurred: int, near: int, far: int) -> tuple[int, Defines]:
    return index, (("TILE_CLASS", index), ("BLURRED", blurred), ("NEAR_LAYER", near), ("FAR_LAYER", far))


TILES = (
    Pass("kernel", "dof/kernel.comp", writes=("kernel",), needed=blurred, defines=lens_defines),
    Pass("tiles", "dof/tiles.comp", reads=("coc",), writes=("tiles",), group=(1, 1), needed=blurred),
    Pass(
        "dilate_rows",
        "dof/dilate.comp",
        reads=("extent=tiles",),
        writes=("tiles_row",),
        defines=lambda s, f: (("AXIS", 0),),
        needed=blurred,
    ),
    Pass(
        "dilate_columns",
        "dof/dilate.comp",
        reads=("extent=tiles_row",),
        writes=("tiles_dilated",),
        defines=lambda s, f: (("AXIS", 1),),
        needed=blurred,
    ),
)

GATHERING = (
    Pass(
        "tile_lists",
        "dof/tile_lists.comp",
        reads=("tiles_dilated",),
        fills=("TileWork",),
        grid="tiles_dilated",
        needed=blurred,
        defines=tile_defines,
    ),
    Pass(
        "downsample",
        "dof/downsample.comp",
        reads=("lit", "coc"),
        writes=("half_color",),
        writes_if=(("half_specular", specular),),
        needed=softened,
    ),
    Pass(
        "prefilter",
        "dof/prefilter.comp",
        reads=("half_color", "kernel"),
        writes=("prefiltered",),
        needed=softened,
        defines=gather_defines,
    ),
    Pass(
        "gather",
        "dof/gather.comp",
        reads=("prefiltered", "tiles_dilated", "kernel"),
        optional=("half_specular",),
        over="TileWork",
        kernels=tile_kernels,
        writes=("far_gather",),
        writes_if=(("near_gather", has_near_layer), ("near_specular", specular)),
        needed=softened,
        defines=layer_defines,
    ),
    Pass(
        "median",
        "dof/median.comp",
        reads=("far_gather", "tiles_dilated"),
        optional=("near_gather",),
        writes=("far_blur",),
        writes_if=(("near_blur", has_near_layer),),
        needed=softened,
        defines=median_defines,
    ),
    Pass(
        "post",
        "dof/post.comp",
        reads=("lit", "coc", "tiles_dilated", "kernel"),
        optional=("half_color", "far_blur", "near_blur", "near_specular"),
        over="TileWork",
        kernels=tile_kernels,
        writes=("post",),
        offers=("post_behind",),
        needed=blurred,
        defines=layer_defines,
    ),
)

POST = (*TILES, *GATHERING)
