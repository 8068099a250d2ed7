"""What every part of a built-in scene needs: frames to stand in, and materials."""

from __future__ import annotations

from typing import Any

import numpy as np
from glb import GlbWriter
from numpy.typing import NDArray
from shapes import unit

F64 = NDArray[np.float64]


def look_at(eye: F64, target: F64) -> F64:
    """Camera to world, -z towards the target."""
    z = unit(eye - target)
    x = unit(np.cross([0.0, 1.0, 0.0], z))
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], 1)
    matrix[:3, 3] = eye
    return matrix


def place(x: float, y: float, z: float, turn: float = 0.0, scale: float = 1.0) -> F64:
    """Standing at a point, turned about the vertical [rad]."""
    c, s = np.cos(turn) * scale, np.sin(turn) * scale
    return np.array([[c, 0, s, x], [0, scale, 0, y], [-s, 0, c, z], [0, 0, 0, 1.0]])


def material(
    writer: GlbWriter, name: str, color: tuple[float, ...], metallic: float, roughness: float, **more: Any
) -> int:
    """A metallic-roughness material; `texture`, `surface`, `normal` are texture references, the rest glTF fields."""
    pbr: dict[str, Any] = {"baseColorFactor": [*color, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}
    for key, slot in (("texture", "baseColorTexture"), ("surface", "metallicRoughnessTexture")):
        if key in more:
            pbr[slot] = more.pop(key)
    if "normal" in more:
        more["normalTexture"] = more.pop("normal")
    return writer.add("materials", {"name": name, "doubleSided": True, "pbrMetallicRoughness": pbr, **more})


def tiled(texture: int, repeats: float) -> dict[str, Any]:
    """A texture reference scaled by KHR_texture_transform."""
    return {"index": texture, "extensions": {"KHR_texture_transform": {"scale": [repeats, repeats]}}}


def add_camera(writer: GlbWriter, camera: F64, fov_y: float, focus_point: F64, aperture: float) -> None:
    """The scene's camera [to world, rad], focused on a point, with a lens `aperture` m wide."""
    extras = {"focus_distance": round(float((camera[:3, 3] - focus_point) @ camera[:3, 2]), 3), "aperture": aperture}
    lens = {
        "type": "perspective",
        "perspective": {"yfov": fov_y, "znear": 0.01},
        "name": "main",
        "extras": extras,
    }
    writer.node("camera", camera, camera=writer.add("cameras", lens))


def finished(writer: GlbWriter) -> bytes:
    """The file, once its scene is in it; it names the extensions that lights, materials and `tiled` use."""
    used = ("KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_texture_transform")
    writer.json |= {"scene": 0, "extensionsUsed": list(used)}
    return writer.to_bytes()
