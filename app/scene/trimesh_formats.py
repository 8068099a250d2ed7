"""OBJ, PLY and STL to a Scene. trimesh decodes; import this module lazily, since trimesh takes long to import."""

from __future__ import annotations

import io
import logging
import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from trimesh.resolvers import FilePathResolver

from ..errors import UserError, quoted
from ..tone import srgb_decode
from .decoded import Decoded
from .geometry import local_origin
from .images import FORMATS, check_size, check_total, inflated
from .model import F32, F64, Image, Instance, Material, TextureSlot
from .obj_text import missing_assets, missing_vertex
from .validate import RawMesh

# Neither format has physical materials: a matt-to-satin surface of medium grey, as modelling tools show such files.
_PLAIN = Material(base_color=(0.6, 0.6, 0.6, 1.0), roughness=0.6, name="plain")
_MASK_AT = 0.5
_MTL_READ = {"kd", "ka", "ks", "ns", "ke", "d", "tr", "illum", "ni", "map_kd", "newmtl"}

logging.getLogger("trimesh").addHandler(logging.NullHandler())  # its tracebacks are for its developers, not for users


def read_with_trimesh(path: Path, progress: Callable[[str, float], None]) -> Decoded:
    """Decode a file by its suffix. Raises UserError when trimesh cannot; its guard against '../' stays on."""
    progress("reading geometry", 0.0)
    kind = path.suffix[1:].upper()
    try:
        # process=False: merging and reordering are not a decoder's business, and would weld sharp edges.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # what is wrong with the numbers is told later, in our words
            scene = trimesh.load_scene(
                _stream(path), path.suffix[1:].lower(), resolver=FilePathResolver(str(path)), process=False
            )
    except OSError as error:
        raise UserError(f"{path} cannot be read ({error.strerror or error}): check the path.") from error
    except Exception as error:  # a third-party parser on arbitrary bytes may raise anything
        if kind == "OBJ" and (lost := missing_vertex(path)):
            raise UserError(f"{path}, {lost}: export it again.") from error
        known = str(error) and not isinstance(error, ImportError)  # it imports a guesser of encodings for damaged text
        reason = quoted(error) if known else "damaged or in an unknown encoding"
        raise UserError(f"{path} cannot be read as {kind} ({reason}): export it again.") from error
    decoded = Decoded([], [], [])
    if kind == "OBJ":
        decoded.notes += missing_assets(path)
    index_of: dict[str, int] = {}
    origins: dict[str, F64] = {}
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        if not isinstance(geometry, trimesh.Trimesh):
            decoded.notes.append("Points and lines were left out.")
            continue
        if name not in index_of:
            index_of[name] = len(decoded.meshes)
            origins[name] = _origin(geometry)
            with np.errstate(over="ignore", invalid="ignore"):  # float64 beyond float32, refused later by validate
                decoded.meshes.append(_mesh(geometry, origins[name], quoted(name), decoded, str(path)))
        placed = np.array(transform, np.float64)
        placed[:3, 3] += placed[:3, :3] @ origins[name]
        decoded.instances.append(Instance(index_of[name], placed, quoted(node)))
    return decoded


def _stream(path: Path) -> io.BytesIO:
    """The file's bytes; OBJ made valid UTF-8 first, because comments in other encodings are common and mean nothing."""
    data = path.read_bytes()
    return io.BytesIO(data.decode("utf-8", errors="replace").encode() if path.suffix.lower() == ".obj" else data)


def _origin(mesh: trimesh.Trimesh) -> F64:
    """(3,) [m] where the mesh's own coordinates are to begin: text holds digits that float32 would round off."""
    vertices = np.asarray(mesh.vertices, np.float64)
    with np.errstate(over="ignore"):
        kept = vertices.shape[1:] != (3,) or not len(vertices) or (vertices.astype(np.float32) == vertices).all()
    return np.zeros(3) if kept else local_origin(vertices.min(axis=0), vertices.max(axis=0))


def _mesh(mesh: trimesh.Trimesh, origin: F64, name: str, decoded: Decoded, source: str) -> RawMesh:
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    positions = (vertices - origin[: vertices.shape[-1]]).astype(np.float32)  # of two numbers each: refused later
    normals = _given_normals(mesh)
    uvs = colors = None
    kind = mesh.visual.kind
    if kind == "texture":
        material = _material(mesh.visual.material, decoded, source)
        uvs = _uvs(mesh, len(positions))
    else:
        material = _PLAIN if kind is None else Material(roughness=_PLAIN.roughness, name="vertex colours")
    if kind == "vertex":
        colors = _linear(mesh.visual.vertex_colors)
    elif kind == "face":  # a colour per face needs corners of its own
        flat = faces.ravel()
        colors = np.repeat(_linear(mesh.visual.face_colors), 3, axis=0)
        positions, faces = positions[flat], np.arange(len(flat)).reshape(-1, 3)
        normals = None if normals is None else normals[flat]
    decoded.materials.append(material)
    return RawMesh(positions, faces, len(decoded.materials) - 1, normals, uvs, None, colors, name)


def _given_normals(mesh: trimesh.Trimesh) -> F32 | None:
    """The file's normals. Asking trimesh for `vertex_normals` would compute them; its cache holds only given ones."""
    if "vertex_normals" not in mesh._cache:
        return None
    return np.asarray(mesh._cache["vertex_normals"], np.float32)


def _uvs(mesh: trimesh.Trimesh, count: int) -> F32 | None:
    uv = mesh.visual.uv
    if uv is None or len(uv) != count or np.ndim(uv) != 2 or np.shape(uv)[1] < 2:
        return None
    return np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1).astype(np.float32)  # trimesh counts v upwards


def _linear(colors: Any) -> F32:
    """(n, 4) linear colours from 8-bit ones, which these formats mean for display (sRGB, IEC 61966-2-1)."""
    c = np.asarray(colors, np.float64) / 255.0
    return np.hstack([srgb_decode(c[:, :3]), c[:, 3:]]).astype(np.float32)


def _material(found: Any, decoded: Decoded, source: str) -> Material:
    """MTL as metallic-roughness: diffuse colour and map, emission, shininess, dissolve."""
    raw: dict[str, Any] = getattr(found, "kwargs", None) or {}
    name = quoted(getattr(found, "name", None) or "plain")
    picture = getattr(found, "image", None)
    color = _floats(raw.get("kd"), 3) or ((1.0, 1.0, 1.0) if picture is not None else _PLAIN.base_color[:3])
    alpha = (_floats(raw.get("d"), 1) or (1.0,))[0]
    slot, holes = _texture(picture, name, decoded, source)
    if alpha < 1.0:
        decoded.notes.append(f"Material {name!r}: transparency is drawn as a mask at {_MASK_AT}.")
    unused = sorted(set(raw) - _MTL_READ)
    if unused:
        decoded.notes.append(f"Material {name!r}: {quoted(', '.join(unused))} is not used.")
    return Material(
        base_color=(*color, alpha),  # type: ignore[arg-type]
        roughness=_roughness(raw.get("ns")),
        emissive=_floats(raw.get("ke"), 3) or (0.0, 0.0, 0.0),  # type: ignore[arg-type]
        alpha_cutoff=_MASK_AT if alpha < _MASK_AT or holes else None,
        base_color_texture=slot,
        name=name,
    )


def _texture(picture: Any, name: str, decoded: Decoded, source: str) -> tuple[TextureSlot | None, bool]:
    """(slot, whether the image has holes) of a Pillow image that trimesh opened."""
    if picture is None:
        return None, False
    if picture.format not in FORMATS:
        decoded.notes.append(f"Material {name!r}: pictures of the kind {quoted(picture.format)} are not read.")
        return None, False
    check_size(picture, name, source)
    check_total([*(i.pixels.size // 4 for i in decoded.images), picture.width * picture.height], source)
    rgba = inflated(picture, name, source)
    decoded.images.append(Image(rgba, True, name))
    return TextureSlot(len(decoded.images) - 1), bool((rgba[..., 3] < 255 * _MASK_AT).any())


def _floats(values: Any, length: int) -> tuple[float, ...] | None:
    """The numbers of an MTL line, or None when there are not that many finite ones."""
    try:
        numbers = tuple(float(v) for v in np.ravel(values))[:length] if values is not None else ()
    except ValueError:
        return None
    return numbers if len(numbers) == length and all(map(math.isfinite, numbers)) else None


def _roughness(shininess: Any) -> float:
    """The square root of the GGX alpha = sqrt(2 / (n + 2)) with a highlight as wide (Walter et al. 2007)."""
    exponent = _floats(shininess, 1)
    return _PLAIN.roughness if exponent is None else (2.0 / (max(exponent[0], 0.0) + 2.0)) ** 0.25
