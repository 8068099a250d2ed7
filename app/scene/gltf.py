"""glTF 2.0 (.gltf, .glb) to a Scene, read by ourselves with numpy.

Reading the accessors takes a hundred lines and is exact. trimesh, which serves the other formats, loses sparse
data, normalised coordinates, wrap modes, tangents, lights and more, and all of it would have to be patched back in.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UserError, quoted
from . import gltf_accessors as accessors
from .decoded import Decoded
from .gltf_animation import read_animation
from .gltf_file import GltfFile, Json
from .gltf_materials import MaterialReader, ReadMaterial
from .gltf_nodes import Node, read_camera, read_light, walk
from .model import Environment, Instance, Light, Material, SceneCamera
from .validate import RawMesh, check_counts

_LINES_AND_POINTS = {0, 1, 2, 3}
_UNDERSTOOD = {
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
}


def read_gltf(path: Path, progress: Callable[[str, float], None]) -> Decoded:
    """Decode a glTF 2.0 file. Raises UserError, one sentence, on anything broken or required and not supported."""
    try:
        return _Reader(GltfFile(path), progress).read()
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, struct.error) as error:
        # The JSON is typed by nobody: a value of the wrong kind shows up as one of these, wherever it is first used.
        reason = f"{type(error).__name__}: {quoted(error)}"
        raise UserError(f"{path} does not follow the glTF 2.0 format ({reason}): re-export the file.") from error
    except MemoryError as error:
        raise UserError(f"{path} does not fit into memory: simplify it.") from error


class _Reader:
    """One pass over the node graph; meshes and materials are read when first met, so unused ones cost nothing."""

    def __init__(self, file: GltfFile, progress: Callable[[str, float], None]) -> None:
        self.file, self.progress = file, progress
        self.notes: list[str] = []
        self.material_reader = MaterialReader(file, self.notes)
        self.materials: list[ReadMaterial] = []
        self.material_index: dict[int | None, int] = {}
        self.meshes: list[RawMesh] = []
        self.mesh_indices: dict[int, list[int]] = {}
        self.counts = 0, 0  # vertices and triangles of all meshes

    def read(self) -> Decoded:
        self._refuse_unknown_requirements()
        instances: list[Instance] = []
        cameras: list[SceneCamera] = []
        lights: list[Light] = []
        nodes = list(walk(self.file, read_animation(self.file, self.notes), self.notes))
        for done, node in enumerate(nodes):
            self.progress("reading geometry", done / len(nodes))
            instances += self._instances(node)
            if "camera" in node.json and (camera := read_camera(self.file, node, self.notes)):
                cameras.append(camera)
            if light := read_light(self.file, node):
                lights.append(light)
            if node.motion and (light or "camera" in node.json):
                self.notes.append("Cameras and lights do not move with their nodes; they stay where time 0 has them.")
        self._note_features()
        self.progress("decoding images", 0.0)
        images = self.material_reader.images()
        materials = [m.material for m in self.materials]
        return Decoded(
            self.meshes, materials, instances, list(images), lights, cameras, self._environment(), self.notes
        )

    def _instances(self, node: Node) -> list[Instance]:
        if "mesh" not in node.json:
            return []
        if "EXT_mesh_gpu_instancing" in node.json.get("extensions", {}):
            self.notes.append("Meshes instanced by EXT_mesh_gpu_instancing are drawn once.")
        name = quoted(node.json.get("name", ""))
        return [Instance(mesh, node.world, name, node.motion) for mesh in self._mesh(node.json["mesh"])]

    def _mesh(self, index: int) -> list[int]:
        """Indices of the RawMeshes, one for each primitive that holds triangles."""
        if index not in self.mesh_indices:
            mesh = self.file.item("meshes", index)
            name = quoted(mesh.get("name") or f"mesh {index}")
            read = [self._primitive(primitive, name) for primitive in mesh["primitives"]]
            found = [raw for raw in read if raw is not None]
            start = len(self.meshes)
            self.meshes += found
            self.mesh_indices[index] = list(range(start, len(self.meshes)))
        return self.mesh_indices[index]

    def _primitive(self, primitive: Json, name: str) -> RawMesh | None:
        extensions, attributes = primitive.get("extensions", {}), primitive["attributes"]
        mode = primitive.get("mode", 4)
        if "KHR_draco_mesh_compression" in extensions:
            raise UserError(f"{self.file.path} uses Draco compression, which is not supported: export it uncompressed.")
        if mode in _LINES_AND_POINTS or "POSITION" not in attributes:
            self.notes.append("Points, lines and meshes without positions were left out.")
            return None
        if "targets" in primitive:
            self.notes.append("Morph targets are not applied; meshes keep their base shape.")
        positions = accessors.read_floats(self.file, attributes["POSITION"], (3,))
        if "indices" in primitive:
            corners = accessors.read_integers(self.file, primitive["indices"])
        else:
            corners = np.arange(len(positions), dtype=np.uint32)
        triangles = _triangles(corners, mode)
        # Counted as they are read: many primitives may share the bytes of one.
        self.counts = self.counts[0] + len(positions), self.counts[1] + len(triangles)
        check_counts(*self.counts, str(self.file.path))
        material = self._material(primitive.get("material"))
        return RawMesh(
            positions,
            triangles,
            material,
            self._attribute(attributes, "NORMAL", (3,)),
            self._attribute(attributes, f"TEXCOORD_{self.materials[material].tex_coord}", (2,)),
            self._attribute(attributes, "TANGENT", (4,)),
            self._colors(attributes),
            name,
        )

    def _attribute(self, attributes: Json, semantic: str, components: tuple[int, ...]) -> Any:
        return accessors.read_floats(self.file, attributes[semantic], components) if semantic in attributes else None

    def _colors(self, attributes: Json) -> Any:
        colors = self._attribute(attributes, "COLOR_0", (3, 4))
        if colors is not None and colors.shape[1] == 3:
            colors = np.hstack([colors, np.ones((len(colors), 1), np.float32)])
        return colors

    def _material(self, index: int | None) -> int:
        if index not in self.material_index:
            # The format's default material is a metal: factors 1 and no texture.
            default = ReadMaterial(Material(metallic=1.0, name="glTF default"), 0)
            self.materials.append(default if index is None else self.material_reader.read(index))
            self.material_index[index] = len(self.materials) - 1
        return self.material_index[index]

    def _refuse_unknown_requirements(self) -> None:
        unknown = sorted(set(self.file.json.get("extensionsRequired", [])) - _UNDERSTOOD)
        if unknown:
            raise UserError(
                f"{self.file.path} requires {quoted(', '.join(unknown))}, which is not supported: export without it."
            )

    def _note_features(self) -> None:
        document = self.file.json
        if document.get("skins"):
            self.notes.append("Skinning is not applied; skinned meshes keep their bind pose.")
        if len(document.get("scenes", [])) > 1:
            self.notes.append(f"Of {len(document['scenes'])} scenes in the file, only the default one is shown.")
        if "EXT_lights_image_based" in document.get("extensions", {}):
            self.notes.append("EXT_lights_image_based is not supported; the sky is two-coloured.")

    def _environment(self) -> Environment:
        """Our own convention, written by the scripts in assets/: the scene's `extras` may give the two radiances."""
        if not self.file.json.get("scenes"):
            return Environment()
        extras = self.file.item("scenes", self.file.json.get("scene", 0)).get("extras")
        given = extras.get("environment") if isinstance(extras, dict) else None
        if not isinstance(given, dict):
            return Environment()
        default = Environment()
        return Environment(_radiance(given.get("sky"), default.sky), _radiance(given.get("ground"), default.ground))


def _radiance(values: object, default: tuple[float, float, float]) -> tuple[float, float, float]:
    if values is None:
        return default
    r, g, b = (float(v) for v in values)  # type: ignore[attr-defined]
    if not all(0.0 <= v < float("inf") for v in (r, g, b)):
        raise ValueError(f"an environment colour {values!r:.60} is negative or infinite")
    return r, g, b


def _triangles(corners: NDArray[np.integer], mode: int) -> NDArray[np.integer]:
    """(m, 3) indices of a list (4), strip (5) or fan (6); a list's incomplete last triangle is dropped."""
    if mode == 4:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if mode == 5:
        strip = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
        strip[1::2] = strip[1::2, [1, 0, 2]]  # every other triangle of a strip winds the other way
        return strip
    if mode == 6:
        return np.stack([np.broadcast_to(corners[:1], len(corners[2:])), corners[1:-1], corners[2:]], axis=1)
    raise ValueError(f"{mode} is no primitive mode")
