"""The scene's numpy arrays in the layout of the GPU structs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bvh.pack import from_lowest_corner
from ..scene.model import F64, U32, Light, Material, TextureSlot, Triangles
from .layout import LIGHT, MATERIAL, VERTEX
from .octahedral import pack_normals, pack_tangents
from .textures import Place, slot_bits

_KINDS = {"sun": 0, "point": 1, "spot": 2}
_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
_SHARPEST_CONE = 1e-3  # cos inner - cos outer at least: glTF's own guard against dividing by zero at a hard spot edge
_SLOTS = (
    ("base", "base_color_texture"),
    ("surface", "metallic_roughness_texture"),
    ("normal", "normal_texture"),
    ("emissive", "emissive_texture"),
)


OBJECT_SHIFT = 24  # of the moving object's index in a vertex's material word: glsl/shared/objects.glsl


def material_words(triangles: Triangles) -> U32:
    """(n,) each vertex's material and, above it, its moving object; just the material where nothing moves."""
    return triangles.materials | triangles.objects << np.uint32(OBJECT_SHIFT)


def pack_vertices(triangles: Triangles) -> NDArray[Any]:
    """(n,) VERTEX records."""
    records = np.zeros(len(triangles.positions), VERTEX)
    for axis, name in enumerate(("px", "py", "pz")):
        records[name] = triangles.positions[:, axis]
    records["u"], records["v"] = triangles.uvs[:, 0], triangles.uvs[:, 1]
    records["normal"] = pack_normals(triangles.normals)
    records["tangent"] = pack_tangents(triangles.tangents)
    records["material"] = material_words(triangles)
    return records


def pack_materials(materials: Sequence[Material], places: Sequence[Place]) -> NDArray[Any]:
    """(n,) MATERIAL records; `places` says where each image of the scene lies."""
    records = np.zeros(len(materials), MATERIAL)
    for record, material in zip(records, materials, strict=True):
        record["base_color"] = material.base_color
        record["emissive"] = material.emissive
        record["alpha_cutoff"] = material.alpha_cutoff or 0.0
        record["metallic"], record["roughness"] = material.metallic, material.roughness
        record["normal_scale"] = material.normal_scale
        for i, (short, attribute) in enumerate(_SLOTS):
            slot: TextureSlot | None = getattr(material, attribute)
            record["textures"][i] = slot_bits(slot, places)
            rows = slot.uv_transform if slot else _IDENTITY
            record[f"uv_{short}_u"][:3], record[f"uv_{short}_v"][:3] = rows
    return records


def pack_lights(lights: Sequence[Light], origin: F64) -> NDArray[Any]:
    """(n,) LIGHT records about the scene's origin, suns first: the first sun is the one with the shadow map."""
    ordered = sorted(lights, key=lambda light: light.kind != "sun")
    records = np.zeros(len(ordered), LIGHT)
    for i, (record, light) in enumerate(zip(records, ordered, strict=True)):
        record["position"], record["direction"] = np.subtract(light.position, origin), light.direction
        record["kind"] = _KINDS[light.kind]
        record["intensity"] = np.multiply(light.color, light.intensity)
        record["inverse_range"] = 1.0 / light.range if light.range > 0.0 else 0.0
        outer, inner = math.cos(light.outer_cone), math.cos(light.inner_cone)
        record["spot_scale"] = 1.0 / max(inner - outer, _SHARPEST_CONE)
        record["spot_offset"] = -outer * record["spot_scale"]
        record["casts_shadow"] = int(i == 0 and light.kind == "sun")
    return records


def oriented(triangles: Triangles) -> Triangles:
    """The same triangles, each wound so that its front is the side its vertex normals point to.

    Winding then tells raster (`gl_FrontFacing`) and rays alike on which side of a two-sided surface the viewer is. Each
    begins with the corner that `from_lowest_corner` picks.
    """
    p, i = triangles.positions, triangles.indices
    corner = p[i[:, 0]]
    cross = np.cross(p[i[:, 1]] - corner, p[i[:, 2]] - corner)
    normal = triangles.normals[i[:, 0]] + triangles.normals[i[:, 1]] + triangles.normals[i[:, 2]]
    away = np.einsum("ij,ij->i", cross, normal) < 0.0
    wound = np.where(away[:, None], i[:, ::-1], i).astype(np.uint32)
    return replace(triangles, indices=from_lowest_corner(p, wound))


def draw_order(triangles: Triangles, masked: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(m,) triangles in the order of drawing, opaque before alpha-masked ones: holes then count only where seen."""
    return np.argsort(masked[triangles.materials[triangles.indices[:, 0]]], kind="stable")
