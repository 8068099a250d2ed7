"""The solids of occluders.py in Mitsuba 3: the same triangles emit their base colour, seen by a `thinlens` sensor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from . import occluders

Solid = occluders.Solid


def load(size: tuple[int, int], folder: Path) -> Any:
    """The Mitsuba scene. Closed solids with outward faces, since Mitsuba's area lights shine from their front only."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    return mitsuba.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 1},  # only what the camera sees directly
            "sensor": _sensor(mitsuba, size),
            "background": {"type": "constant", "radiance": _rgb(occluders.BACKGROUND)},
            **{f"solid_{i}": _solid(s, folder / f"{i}.ply") for i, s in enumerate(occluders.solids())},
        }
    )


def runs(scene: Any, spp: int, seeds: range) -> np.ndarray:
    """Independent pictures (len(seeds), h, w, 3), top row first."""
    import mitsuba

    return np.stack([np.array(mitsuba.render(scene, spp=spp, seed=seed), np.float64)[..., :3] for seed in seeds])


def _sensor(mitsuba: Any, size: tuple[int, int]) -> dict[str, Any]:
    to_world = mitsuba.ScalarTransform4f().look_at(origin=occluders.EYE, target=occluders.TARGET, up=(0.0, 1.0, 0.0))
    return {
        "type": "thinlens",
        "to_world": to_world,
        "fov": occluders.FOV_Y_DEG,
        "fov_axis": "y",
        "aperture_radius": occluders.APERTURE / 2,  # ours is a diameter
        "focus_distance": occluders.FOCUS,  # along the axis in both
        "near_clip": 0.01,
        "film": {
            "type": "hdrfilm",
            "width": size[0],
            "height": size[1],
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},  # a pixel's own square, as ours
        },
        "sampler": {"type": "independent"},
    }


def _solid(solid: Solid, path: Path) -> dict[str, Any]:
    solid.shape.export(path)
    return {
        "type": "ply",
        "filename": str(path),
        "face_normals": True,
        "emitter": {"type": "area", "radiance": _rgb(solid.color)},
        "bsdf": {"type": "diffuse", "reflectance": _rgb((0.0, 0.0, 0.0))},
    }


def _rgb(color: tuple[float, float, float]) -> dict[str, Any]:
    return {"type": "rgb", "value": list(color)}
