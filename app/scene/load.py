"""One entrance for scenes: a built-in name or a file becomes a checked Scene with a report of what was changed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import UserError
from ..files import is_file, is_folder, user_path
from ..interrupts import held_back
from . import gallery
from .bounded import bound
from .decoded import Decoded
from .flatten import rest_box
from .geometry import local_origin
from .gltf import read_gltf
from .model import F64, LARGEST_IMAGE_PX, Image, Instance, LoadReport, Mesh, Scene
from .motion import Motion
from .stress.catalogue import PREFIX, stress_scene
from .validate import (
    FINE_STEP,
    MAX_MOVING,
    MAX_TRIANGLES,
    MAX_VERTICES,
    Repairs,
    check_moving,
    check_placed,
    clean,
    length,
)
from .vertex_colors import colors_to_materials

Progress = Callable[[str, float], None]

GLTF, OTHERS = (".glb", ".gltf"), (".obj", ".ply", ".stl")


def load_scene(path_or_name: str | Path, progress: Progress | None = None) -> Scene:
    """Load a built-in or stress scene by name, or a .glb, .gltf, .obj, .ply or .stl file.

    `progress(stage, fraction)` is called now and then, from this thread. Raises UserError for anything that cannot be
    drawn: missing or unknown files, damaged or hostile content, scenes without triangles.
    """
    started = time.perf_counter()
    report = progress or (lambda stage, fraction: None)
    if stress := stress_scene(str(path_or_name)):
        return checked(stress.make(), stress.name, report, started, may_be_empty=True)
    path = scene_file(path_or_name)
    return checked(_decode(path, report), str(path), report, started)


def checked(
    decoded: Decoded, source: str, report: Progress, started: float | None = None, *, may_be_empty: bool = False
) -> Scene:
    """The scene of what was decoded from `source`, begun at `started` [s]. Raises UserError as `load_scene`."""
    started = time.perf_counter() if started is None else started
    bound(decoded)
    colors_to_materials(decoded, source)
    repairs = Repairs()
    meshes = []
    for index, raw in enumerate(decoded.meshes):
        report("checking geometry", index / len(decoded.meshes))
        slot = decoded.materials[raw.material].normal_texture
        normal_map = None if slot is None else np.asarray(slot.uv_transform)
        meshes.append((clean(raw, f"{source}: mesh {raw.name!r}", normal_map, repairs), len(raw.triangles)))
    report("checking geometry", 1.0)
    return _scene(decoded, meshes, repairs, source, started, may_be_empty)


def scene_file(path_or_name: str | Path) -> Path:
    """Where a built-in scene or a file lies; of a stress scene, the code that makes it.

    Raises UserError for what cannot be a scene.
    """
    if stress := stress_scene(str(path_or_name)):
        return stress.module
    built_in = gallery.find(str(path_or_name))
    path = built_in.path if built_in else user_path(path_or_name)
    known = f"a built-in scene ({', '.join(entry.name for entry in gallery.SCENES)}, or {PREFIX}NAME)"
    if not str(path_or_name).strip():
        raise UserError(f"the scene's name is empty: give the path of a file, or {known}.")
    if is_folder(path):
        raise UserError(f"{path} is a folder: give the path of a file in it, or {known}.")
    if path.suffix.lower() not in GLTF + OTHERS:
        raise UserError(f"{path} is neither {known} nor a file of a known kind ({' '.join(GLTF + OTHERS)}).")
    if not is_file(path):
        raise UserError(f"{path} does not exist or is no file: check the path.")
    return path


def _decode(path: Path, progress: Progress) -> Decoded:
    if path.suffix.lower() in GLTF:
        return read_gltf(path, progress)
    with held_back():  # while trimesh looks for packages, it takes Ctrl-C for the lack of one
        from .trimesh_formats import read_with_trimesh  # costs up to two seconds, which glTF users need not pay

    return read_with_trimesh(path, progress)


def _scene(
    decoded: Decoded,
    cleaned: list[tuple[Mesh, int]],
    repairs: Repairs,
    source: str,
    started: float,
    may_be_empty: bool,
) -> Scene:
    meshes = [mesh for mesh, _ in cleaned]
    instances = [i for i in decoded.instances if len(meshes[i.mesh].triangles)]
    instances = _with_few_moving(instances, decoded.notes)
    _check_places(meshes, instances, source)
    triangles = sum(cleaned[i.mesh][1] for i in decoded.instances)
    kept = sum(len(meshes[i.mesh].triangles) for i in instances)
    if not kept and not may_be_empty:
        raise UserError(f"{source} holds no triangles that could be drawn: choose another file.")
    if triangles > MAX_TRIANGLES:
        raise UserError(f"{source} places {triangles} triangles, over the limit of {MAX_TRIANGLES}: simplify it.")
    vertices = sum(len(meshes[i.mesh].positions) for i in instances)
    if vertices > MAX_VERTICES:
        raise UserError(f"{source} places {vertices} vertices, over the limit of {MAX_VERTICES}: simplify it.")
    summary = LoadReport(
        source=source,
        triangles=triangles,
        vertices=vertices,
        degenerate=triangles - kept,
        notes=(*dict.fromkeys(decoded.notes), *repairs.notes(), *_wide(meshes, instances), *_reduced(decoded.images)),
        seconds=time.perf_counter() - started,
    )
    return Scene(
        tuple(meshes),
        tuple(decoded.materials),
        tuple(instances),
        tuple(decoded.images),
        tuple(decoded.lights),
        decoded.environment,
        tuple(decoded.cameras),
        summary,
    )


def _check_places(meshes: list[Mesh], instances: list[Instance], source: str) -> None:
    """Raise UserError unless everything stays near enough to the origin, at all times."""
    moving: dict[Motion, F64] = {}
    extents: dict[int, F64] = {}  # many instances may share a mesh
    for instance in instances:
        if instance.mesh not in extents:
            extents[instance.mesh] = np.abs(meshes[instance.mesh].positions).max(axis=0, initial=0.0)
        reach = check_placed(extents[instance.mesh], instance, f"{source}: {instance.name or 'a mesh'}")
        if instance.motion:
            moving[instance.motion] = np.maximum(reach, moving.get(instance.motion, reach))
    for motion, reach in moving.items():
        check_moving(motion, reach, f"{source}: {motion.name or 'a moving mesh'}")


def _with_few_moving(instances: list[Instance], notes: list[str]) -> list[Instance]:
    """The instances, with all beyond the first MAX_MOVING objects standing still."""
    motions = list(dict.fromkeys(i.motion for i in instances if i.motion))
    if len(motions) <= MAX_MOVING:
        return instances
    notes.append(f"Of {len(motions)} moving objects, only the first {MAX_MOVING} move.")
    kept = {None, *motions[:MAX_MOVING]}
    return [i if i.motion in kept else replace(i, motion=None) for i in instances]


def _wide(meshes: list[Mesh], instances: list[Instance]) -> list[str]:
    """A note on a scene that float32 does not resolve everywhere, though its coordinates begin at its middle."""
    low, high = rest_box(meshes, instances)
    step = float(np.spacing(np.float32(np.abs([low, high] - local_origin(low, high)).max())))
    if step < FINE_STEP:
        return []
    across = length(float(np.linalg.norm(high - low)))
    return [f"The scene is {across} across: at its rim positions are kept to {length(step)}."]


def _reduced(images: Sequence[Image]) -> list[str]:
    """A note on images that are larger than what is drawn."""
    count = sum(max(image.pixels.shape[:2]) > LARGEST_IMAGE_PX for image in images)
    return [f"{count} images are larger than {LARGEST_IMAGE_PX} px a side and are drawn at that size."] if count else []
