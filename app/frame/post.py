"""Stage 4: depth of field as a post-process, adapted from Jimenez 2014."""

from __future__ import annotations

from ..optics import IN_FOCUS_COC_PX
from ..scene.facts import Facts
from ..settings import Settings
from .raster import lit
from .records import Defines, Need, Pass


def blurred(settings: Settings, facts: Facts) -> Need:
    """Any blur at all: only if a circle of confusion larger than the focus zone's can appear."""
    if settings.lens.aperture == 0.0:
        return Need(False, "the aperture is 0, a pinhole: everything is sharp")
    largest = max(facts.near_coc_px, facts.far_coc_px)
    if largest <= IN_FOCUS_COC_PX:
        return Need(False, f"the largest circle of confusion is {largest:.2f} px in radius, within the focus zone")
    return Need(True, f"circles of confusion reach {largest:.0f} px in radius")


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
    """Whether tiles are told apart, and where their classes meet."""
    return (("TILE_CLASSES", int(settings.post.tile_classes)), ("SLIGHT_FOCUS", int(settings.post.slight_focus)))


def median_defines(settings: Settings, facts: Facts) -> Defines:
    """Whether the 3x3 median filters or just passes on."""
    return (("MEDIAN", int(settings.post.median)), ("RINGS", settings.post.rings))


def specular(settings: Settings, facts: Facts) -> bool:
    """Whether there is any specular light to keep apart."""
    return lit(settings)


def _kernel(index: int, blurred: int, near: int, far: int) -> Defines:
    return ("TILE_CLASS", index), ("BLURRED", blurred), ("NEAR_LAYER", near), ("FAR_LAYER", far)


# Of the classes in dof/tile_classes.glsl, in their order: sharp, slight, near, far, mixed.
KERNELS = (_kernel(0, 0, 0, 0), _kernel(1, 1, 0, 0), _kernel(2, 1, 1, 0), _kernel(3, 1, 0, 1), _kernel(4, 1, 1, 1))

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
        needed=blurred,
    ),
    Pass(
        "prefilter",
        "dof/prefilter.comp",
        reads=("half_color", "kernel"),
        writes=("prefiltered",),
        needed=blurred,
        defines=gather_defines,
    ),
    Pass(
        "gather",
        "dof/gather.comp",
        reads=("prefiltered", "tiles_dilated", "kernel"),
        optional=("half_specular",),
        buffers=("TileWork",),
        indirect=("TileWork", 0),
        kernels=KERNELS,
        writes=("near_gather", "far_gather"),
        writes_if=(("near_specular", specular),),
        needed=blurred,
        defines=layer_defines,
    ),
    Pass(
        "median",
        "dof/median.comp",
        reads=("near_gather", "far_gather", "tiles_dilated"),
        writes=("near_blur", "far_blur"),
        needed=blurred,
        defines=median_defines,
    ),
    Pass(
        "post",
        "dof/post.comp",
        reads=("lit", "coc", "near_blur", "far_blur", "half_color", "tiles_dilated", "kernel"),
        optional=("near_specular",),
        buffers=("TileWork",),
        indirect=("TileWork", 0),
        kernels=KERNELS,
        writes=("post",),
        offers=("post_behind",),
        needed=blurred,
        defines=layer_defines,
    ),
)

POST = (*TILES, *GATHERING)
