"""Converged pictures to measure against, kept in out/references/ for as long as nothing they depend on changes.

They are the raster reference: it shares no visibility code with the rays it judges, costs a fifth of the traced view,
and its frames tell which depths each pixel sees through the lens.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.camera import Moment, camera_values
from app.gpu.context import device_name
from app.gpu.shaders import assemble, load_glsl
from app.optics import IN_FOCUS_COC_PX, coc_px, coc_scale_px
from app.picture import write_atomically
from app.settings import Settings, to_dict

from .flip import flip_of_noise
from .stage import Stage

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "out" / "references"

SEEDS = (1000, 1001)  # one a half; far from the seeds of what is measured
# Shares of the lens between which a pixel counts as seeing the near field and what is behind it, too: one lens point
# in fifty, which is less than a level of 255 in most pictures.
BOTH_SIDES = (0.02, 0.98)

# What decides the picture, as far as it is not in the key itself.
SHADERS = (
    "raster/gbuffer.vert",
    "raster/gbuffer.frag",
    "raster/shadow.vert",
    "raster/shadow.frag",
    "raster/lighting.comp",
    "output/accumulate_mean.comp",
)
SOURCES = (
    "app/camera.py",
    "app/optics.py",
    "app/sampling.py",
    "app/frame/raster.py",
    "app/scene/*.py",
    *(
        f"app/gpu/{name}.py"
        for name in ("arrays", "frame_block", "layout", "objects", "octahedral", "scene", "shadow", "textures")
    ),
    "tests/image/references.py",
)


@dataclass(frozen=True)
class Reference:
    """Two independent halves of one converged picture."""

    halves: NDArray[np.float32]  # (2, h, w, 4) linear radiance, and the share of the lens that sees the near field

    @cached_property
    def picture(self) -> NDArray[np.float64]:
        """Linear radiance (h, w, 3), top row first."""
        return self.halves[..., :3].mean(0, dtype=np.float64)

    @cached_property
    def near(self) -> NDArray[np.float64]:
        """Share of the lens (h, w) that sees something nearer than the focus zone."""
        return self.halves[..., 3].mean(0, dtype=np.float64)

    @cached_property
    def both_sides(self) -> NDArray[np.bool_]:
        """Pixels (h, w) that see, through parts of the lens, the near field and what lies behind it."""
        return (self.near > BOTH_SIDES[0]) & (self.near < BOTH_SIDES[1])

    @cached_property
    def noise(self) -> float:
        """FLIP between two references of as many lens points, at most."""
        return flip_of_noise(self.halves[0, ..., :3], self.halves[1, ..., :3])


def reference(
    ctx: moderngl.Context,
    stage: Stage,
    scene: str,
    size: tuple[int, int],
    spp: int,
    moment: Moment | None = None,
) -> Reference:
    """The view of a stage at a moment (default: its camera, time 0), read from FOLDER or drawn and kept there.

    `scene` is a digest of the scene; `spp` is even.
    """
    moment = moment or Moment(stage.camera, 0.0)
    path = FOLDER / f"{key(device_name(ctx), scene, size, spp, moment, stage.settings)}.npy"
    if not path.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        halves = drawn(stage, size, spp, moment)
        write_atomically(path, lambda temporary: np.save(temporary, halves))
    return Reference(np.load(path))


def drawn(stage: Stage, size: tuple[int, int], spp: int, moment: Moment) -> NDArray[np.float32]:
    """(2, h, w, 4): two halves of spp / 2 lens points each, as Reference holds them."""
    lens = stage.settings.lens
    scale = coc_scale_px(lens.aperture, size[1], moment.camera.fov_y)
    halves = np.zeros((2, size[1], size[0], 4), np.float32)
    for half, seed in zip(halves, SEEDS, strict=True):
        count = np.zeros((size[1], size[0]))
        for renderer in stage.frames("reference", size, [moment] * (spp // 2), seed=seed):
            depth = renderer.read("depth")[::-1, :, 0]
            count += coc_px(depth, scale, 1.0 / lens.focus_distance) < -IN_FOCUS_COC_PX
        half[..., :3] = stage.renderer.linear()
        half[..., 3] = count / (spp // 2)
    return halves


def key(device: str, scene: str, size: tuple[int, int], spp: int, moment: Moment, settings: Settings) -> str:
    """Differs whenever the reference would. Of the settings, only the lens' and the shading's reach it."""
    parts = {
        "sources": sources_digest(),
        "device": device,
        "scene": scene,
        "size": size,
        "spp": spp,
        "camera": camera_values(moment.camera),
        "time_s": moment.time_s,
        "settings": {k: v for k, v in to_dict(settings).items() if k.startswith(("lens.", "shading."))},
    }
    return digest([json.dumps(parts, sort_keys=True)])[:32]


@cache
def sources_digest() -> str:
    """Of all shaders and modules that the raster reference is made by."""
    files = load_glsl()
    texts = [assemble(name, files).text for name in SHADERS]
    modules = [path for pattern in SOURCES for path in sorted(ROOT.glob(pattern))]
    return digest([*texts, *(path.read_text(encoding="utf-8") for path in modules)])


def digest(texts: Iterable[str]) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()
