"""Vertex colours as materials: the renderer's vertices carry none, so similar triangles share a flat colour instead."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from .decoded import Decoded
from .geometry import area_weighted_normals
from .model import F32, F64, Material
from .validate import RawMesh, check, count

MAX_COLORS = 64  # per mesh: below one 8-bit step in 16 on a typical scan, while the material table stays small


def colors_to_materials(decoded: Decoded, source: str) -> None:
    """Replace every mesh with vertex colours by one mesh for each group of similarly coloured triangles, in place.

    A group's material is the mesh's own with its base colour multiplied by the group's mean colour. Raises UserError,
    naming `source`, when such a mesh is invalid.
    """
    meshes: list[RawMesh] = []
    parts: list[list[int]] = []
    colored = 0
    for raw in decoded.meshes:
        pieces = _split(raw, decoded.materials, source)
        colored += pieces[0] is not raw
        parts.append(list(range(len(meshes), len(meshes) + len(pieces))))
        meshes += pieces
    if colored:
        decoded.notes.append(f"Vertex colours of {count(colored, 'mesh', 'meshes')} became flat colours per triangle.")
    decoded.meshes = meshes
    decoded.instances = [replace(i, mesh=m) for i in decoded.instances for m in parts[i.mesh]]


def _split(raw: RawMesh, materials: list[Material], source: str) -> list[RawMesh]:
    if raw.colors is None or not len(raw.triangles):
        return [raw]
    check(raw, f"{source}: mesh {raw.name!r}")
    faces = np.clip(np.nan_to_num(raw.colors), 0.0, 1.0)[raw.triangles].mean(axis=1, dtype=np.float64)
    if np.array_equal(faces, np.ones_like(faces)):
        return [raw]
    normals = raw.normals  # computed ones must come from the whole mesh, or every colour border would be a crease
    if normals is None:
        normals = area_weighted_normals(raw.positions, raw.triangles.astype(np.uint32)).astype(np.float32)
    whole = replace(raw, normals=normals, colors=None)
    groups = _group(faces)
    pieces = []
    for group in range(int(groups.max()) + 1):
        members = groups == group
        material = _tinted(materials[raw.material], faces[members].mean(axis=0))
        pieces.append(replace(whole, triangles=raw.triangles[members], material=len(materials)))
        materials.append(material)
    return pieces


def _group(faces: F64) -> NDArray[np.int64]:
    """(m,) group of each (m, 4) linear face colour: exact while there are few, else by median cut."""
    bytes_ = np.round(255.0 * faces[:, :3] ** (1.0 / 2.2)).astype(np.uint8)
    colors, group = np.unique(bytes_, axis=0, return_inverse=True)
    group = group.ravel()
    if len(colors) <= MAX_COLORS:
        return group
    swatch = PIL.Image.fromarray(colors[None]).quantize(MAX_COLORS, PIL.Image.Quantize.MEDIANCUT)
    _, compact = np.unique(np.asarray(swatch).ravel(), return_inverse=True)
    return compact[group]


def _tinted(material: Material, color: F32 | F64) -> Material:
    r, g, b, a = (float(m * c) for m, c in zip(material.base_color, color, strict=True))
    return replace(material, base_color=(r, g, b, a))
