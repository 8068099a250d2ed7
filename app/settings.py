"""Every setting, defined once: default, range, unit, meaning, and how the GPU takes it.

Command-line flags, panel widgets, presets, picture metadata, tests and the history-reset key are all derived from these
classes by `walk`. A new setting is one line here. Settings are frozen values: `put` returns changed ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from .errors import UserError
from .knob import knob, parse, plain, put, steps, walk

__all__ = [
    "Settings",
    "from_dict",
    "history_key",
    "knob",
    "opened",
    "parse",
    "plain",
    "put",
    "steps",
    "to_dict",
    "walk",
]


class ShadingMode(Enum):
    """What a surface point shows."""

    LIT = "lit"
    UNLIT = "unlit"


class ToneMap(Enum):
    """How linear light becomes display values."""

    LINEAR = "linear"
    ACES = "aces"
    NEUTRAL = "neutral"


@dataclass(frozen=True)
class Lens:
    aperture: float = knob(
        0.05,
        0.0,
        1.0,
        unit="m",
        doc="Diameter of the lens opening; 0 is a pinhole and blurs nothing.",
        log=True,
    )
    focus_distance: float = knob(
        2.0, 1e-3, 1e6, unit="m", doc="Planar distance of the plane in perfect focus; 1e6 is infinity.", log=True
    )
    blades: int = knob(0, 0, 16, doc="Sides of the aperture polygon; below 3 it is a circle.")
    rotation: float = knob(0.0, -180.0, 180.0, unit="deg", doc="Turns the aperture counter-clockwise.")
    anamorphic: float = knob(
        1.0, 1.0, 4.0, doc="Horizontal squeeze of the aperture: 2 makes bokeh twice as tall as wide.", log=True
    )
    spherical_aberration: float = knob(
        0.0, -1.0, 1.0, doc="Brightness of the bokeh's rim (positive) against its centre (negative)."
    )
    cat_eye: float = knob(
        0.0, 0.0, 1.0, doc="How far the barrel narrows bokeh towards the corners; its shape only, brightness is kept."
    )


@dataclass(frozen=True)
class Post:
    max_coc: float = knob(
        0.12, 0.01, 0.3, unit="of height", doc="Largest circle-of-confusion radius that the post-process gathers."
    )
    rings: int = knob(
        4,
        2,
        8,
        doc="Rings of the gather kernel: the number of taps grows with their square.",
        static=True,
        quality=(2, 3, 4, 6, 8),
    )
    layer_fade: float = knob(
        2.0, 0.25, 16.0, unit="px", doc="CoC difference over which the presort moves a sample from fore- to background."
    )
    slight_focus: bool = knob(
        True,
        doc="Blur slight defocus at full resolution, where half resolution would alias.",
        static=True,
        off=False,
        quality=(False, True),
    )
    tile_classes: bool = knob(
        True, doc="Draw tiles by kind, each with a kernel that holds no more than it needs.", static=True, off=False
    )
    median: bool = knob(
        True,
        doc="3x3 median after the gather, against its sampling noise.",
        static=True,
        off=False,
        quality=(False, True),
    )


@dataclass(frozen=True)
class Mask:
    edges: bool = knob(
        True, doc="Rays only where the blur of a near edge reaches; off: in every pixel.", static=True, off=False
    )
    scouts: bool = knob(
        True,
        doc="A ray per tile looks out for blur from what the raster image does not hold.",
        static=True,
        off=False,
        quality=(False, True),
    )
    settle: bool = knob(True, doc="No rays for still pixels whose noise no display shows.", static=True, off=False)
    sensitivity: float = knob(
        1.0, 0.01, 100.0, doc="s of the mask response 1 - 1/(s x + 1) to the Sobel gradient x.", log=True
    )
    smoothing: float = knob(
        1.0,
        0.0,
        3.0,
        unit="px",
        doc="Standard deviation of the Gaussian applied to the G-buffer before the Sobel filter.",
        off=0.0,
    )
    threshold: float = knob(
        0.1, 0.0, 1.0, doc="Mask responses below this get no rays.", quality=(0.5, 0.25, 0.1, 0.05, 0.02)
    )
    variance: float = knob(
        2.0,
        0.0,
        100.0,
        doc="Rays for noise: weight of the deviation of a pixel's rays beside the edge response.",
        off=0.0,
    )


@dataclass(frozen=True)
class Rays:
    budget: float = knob(
        4.0,
        0.25,
        64.0,
        unit="rays",
        doc="Mean lens rays per masked pixel and frame (hybrid).",
        log=True,
        quality=(0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0),
    )
    max_per_pixel: int = knob(16, 1, 256, unit="rays", doc="Most lens rays for one masked pixel in a frame (hybrid).")
    focus_blend: float = knob(
        1.0,
        0.05,
        8.0,
        unit="px",
        doc="CoC radius over which a hit passes from the near to the far layer.",
        log=True,
        off=0.05,
    )
    history: float = knob(
        0.4,
        0.005,
        1.0,
        doc="Smallest weight of the newest rays in both layers while something moves.",
        log=True,
    )
    samples_per_frame: int = knob(
        1,
        1,
        64,
        doc="Lens samples per pixel that the ray-traced view adds each frame.",
        resets=False,
        quality=(1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64),
    )


@dataclass(frozen=True)
class Reconstruct:
    temporal: bool = knob(True, doc="Accumulate the rays of earlier frames.", static=True, off=False)
    motion: bool = knob(
        True,
        doc="Fetch each layer's history from where its surfaces were; off: from the same pixel.",
        static=True,
        off=False,
    )
    rejection: bool = knob(
        True,
        doc="Drop history of another depth, and hit ratios that the newest rays contradict.",
        static=True,
        off=False,
    )
    gradients: bool = knob(
        True, doc="Trace stored lens rays again and shorten history where their light changed.", static=True, off=False
    )
    spatial: bool = knob(
        True,
        doc="Smooth the noise of few rays with neighbours whose blur reaches the pixel.",
        static=True,
        off=False,
        quality=(False, True),
    )
    radius: float = knob(
        0.2, 0.0, 1.0, doc="Radius over which a traced layer is gathered from its neighbours, as a part of its CoC's."
    )


@dataclass(frozen=True)
class Blend:
    raster: bool = knob(
        True, doc="What is in focus behind blur is the full-resolution raster image.", static=True, off=False
    )
    hit_ratio: float = knob(
        0.9,
        0.01,
        1.0,
        doc="Far field: traced colour is used below this near-hit ratio, the post-process above.",
        off=1.0,
    )
    specular: float = knob(
        4.0,
        0.1,
        100.0,
        doc="Near field: specular luminance from which bright bokeh takes the post-process colour.",
        log=True,
        off=100.0,
    )


@dataclass(frozen=True)
class Shading:
    mode: ShadingMode = knob(
        ShadingMode.LIT,
        doc="lit: glTF metallic-roughness. unlit: base colour only, to compare with other renderers.",
        static=True,
    )
    background: tuple[float, float, float] = knob(
        (0.5, 0.6, 0.7), 0.0, 100.0, doc="Linear colour where no surface is seen (unlit mode)."
    )
    shadows: bool = knob(True, doc="The sun casts shadows.", static=True)
    exposure: float = knob(0.0, -10.0, 10.0, unit="EV", doc="Brightness before tone mapping, in stops.", resets=False)
    tone_map: ToneMap = knob(
        ToneMap.LINEAR, doc="linear clips; aces compresses highlights; neutral keeps hues.", static=True, resets=False
    )


@dataclass(frozen=True)
class Temporal:
    antialias: bool = knob(
        True, doc="Jitter the samples within the pixel and accumulate frames.", static=True, off=False
    )
    alpha: float = knob(
        0.1,
        0.01,
        1.0,
        doc="Weight of the newest frame while something moves; a still picture averages all frames.",
        log=True,
        resets=False,
    )


@dataclass(frozen=True)
class Overlay:
    focus_plane: bool = knob(False, doc="Tint what lies within the focus zone.", resets=False)
    range_low: float = knob(
        0.0, -1000.0, 1000.0, doc="Target viewer: value at the start of the colour map.", resets=False
    )
    range_high: float = knob(
        0.0,
        -1000.0,
        1000.0,
        doc="Target viewer: value at its end; equal to the start: the target's own range.",
        resets=False,
    )


@dataclass(frozen=True)
class Settings:
    lens: Lens = field(default_factory=Lens)
    post: Post = field(default_factory=Post)
    mask: Mask = field(default_factory=Mask)
    rays: Rays = field(default_factory=Rays)
    reconstruct: Reconstruct = field(default_factory=Reconstruct)
    blend: Blend = field(default_factory=Blend)
    shading: Shading = field(default_factory=Shading)
    temporal: Temporal = field(default_factory=Temporal)
    overlay: Overlay = field(default_factory=Overlay)


def opened(settings: Settings) -> Settings:
    """The same through a lens: the default one in place of a pinhole, which calls for nothing that lenses do."""
    return settings if settings.lens.aperture else put(settings, "lens.aperture", Lens().aperture)


def to_dict(settings: Settings) -> dict[str, Any]:
    """Flat {dotted path: JSON value}: presets, picture metadata and reports."""
    return {path: plain(value) for path, _, value in walk(settings)}


def from_dict(values: Mapping[str, Any], base: Settings | None = None) -> Settings:
    """Settings from such a dictionary, checked like command-line text. Raises UserError."""
    result = base or Settings()
    leaves = {path: leaf for path, leaf, _ in walk(result)}
    for path, value in values.items():
        if path not in leaves:
            raise UserError(f"there is no setting {path!r}")
        text = ",".join(map(str, value)) if isinstance(value, list) else str(value)
        result = put(result, path, parse(path, text, leaves[path]))
    return result


def history_key(settings: Settings) -> tuple[Any, ...]:
    """Equal for two settings exactly if samples accumulated under one are valid under the other."""
    return tuple(value for _, leaf, value in walk(settings) if leaf.metadata["resets"])
