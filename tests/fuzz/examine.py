"""What must hold of any model file: it is refused in one sentence, or all that comes of it is sound."""

from __future__ import annotations

import math
import os
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.bvh.build import build_bvh
from app.bvh.pack import child_boxes, is_inner, is_leaf, leaf_range
from app.bvh.top import scene_tree
from app.errors import BAD_INPUT, UserError
from app.gpu.arrays import draw_order, oriented, pack_lights, pack_materials, pack_vertices
from app.gpu.textures import Place
from app.scene.facts import frame_facts, near_plane, scene_facts
from app.scene.flatten import bounds
from app.scene.model import Scene, Triangles
from app.session import focused, open_scene, viewpoints
from app.settings import Settings

LONGEST_SENTENCE = 600  # characters beside the path
SILENT = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)  # Python does not print them
MAY_BE_INFINITE = {"range"}  # of a light: it ends nowhere


class Outcome(NamedTuple):
    """What became of a file: "loaded", "refused", or "wrong" with what is wrong."""

    kind: str
    text: str = ""


def examine(path: Path) -> Outcome:
    """Load a file as the program does and look at everything that comes of it."""
    with _Printed() as printed, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            outcome = _loaded(path)
        except UserError as error:
            outcome = _refused(error, path)
        except BaseException:
            outcome = Outcome("wrong", "raised " + traceback.format_exc(limit=-4))
    shown = [str(w.message) for w in warned if not issubclass(w.category, SILENT)]
    if shown or printed.text:
        return Outcome("wrong", f"{outcome.kind}, but printed {shown or printed.text!r:.500}")
    return outcome


def _refused(error: UserError, path: Path) -> Outcome:
    text, causes = str(error), list(_causes(error))
    if error.exit_code != BAD_INPUT:
        return Outcome("wrong", f"exit code {error.exit_code}: {text}")
    if str(path) not in text:
        return Outcome("wrong", f"does not name the file: {text}")
    if not text.replace(str(path), "").isprintable() or len(text) > LONGEST_SENTENCE + len(str(path)):
        return Outcome("wrong", f"no sentence: {text[:300]!r}, {len(text)} characters")
    if any(isinstance(cause, MemoryError) for cause in causes):
        return Outcome("wrong", f"only the lack of memory stopped it: {text}")
    return Outcome("refused", text)


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def _loaded(path: Path) -> Outcome:
    scene, triangles = open_scene(str(path))
    wrong = [*_of_scene(scene), *_of_drawing(scene, oriented(triangles))]
    return Outcome("wrong", "; ".join(wrong)) if wrong else Outcome("loaded", " ".join(scene.report.notes))


def _of_scene(scene: Scene) -> Iterator[str]:
    """What is wrong with the arrays and numbers of a scene."""
    yield from (f"{where} is {value}" for where, value in _numbers(scene, "scene") if not _sound(where, value))
    yield from (f"{text!r:.80} cannot be shown" for text in _texts(scene) if not text.isprintable() or len(text) > 500)
    for mesh in scene.meshes:
        count = len(mesh.positions)
        lengths = {len(mesh.normals), len(mesh.uvs), len(mesh.tangents)}
        if lengths != {count} or (len(mesh.triangles) and mesh.triangles.max() >= count):
            yield f"mesh {mesh.name!r} does not fit together"
        if not 0 <= mesh.material < len(scene.materials):
            yield f"mesh {mesh.name!r} has no material"
        if count and np.abs(np.linalg.norm(mesh.normals, axis=1) - 1.0).max() > 1e-5:
            yield f"mesh {mesh.name!r} has normals that are not unit"
    for material in scene.materials:
        slots = [getattr(material, f.name) for f in fields(material) if f.name.endswith("_texture")]
        if any(slot and not 0 <= slot.image < len(scene.images) for slot in slots):
            yield f"material {material.name!r} has no image"
        ranges = (*material.base_color, material.metallic, material.roughness)
        if min(ranges) < 0.0 or max(ranges) > 1.0 or min(material.emissive) < 0.0 or max(material.emissive) > 1e9:
            yield f"{material} is out of range"
    for image in scene.images:
        if image.pixels.dtype != np.uint8 or image.pixels.ndim != 3 or not image.pixels.size:
            yield f"image {image.name!r} is none"


def _of_drawing(scene: Scene, triangles: Triangles) -> Iterator[str]:
    """What is wrong with what is drawn: world-space triangles, tree, records, viewpoints."""
    yield from (f"{where} is {value}" for where, value in _numbers(triangles, "triangles") if not _sound(where, value))
    if not len(triangles.indices) or triangles.indices.max() >= len(triangles.positions):
        yield "no triangle is drawn, or one is out of range"
        return
    drawn = triangles.normals[triangles.indices.ravel()]
    if np.abs(np.linalg.norm(drawn, axis=1) - 1.0).max() > 1e-5:
        yield "a normal in the world is not unit"
    yield from _of_tree(triangles)
    places = [Place(0, layer) for layer in range(len(scene.images))]
    lights = pack_lights(scene.lights, triangles.origin)
    for records in (pack_vertices(triangles), pack_materials(scene.materials, places), lights):
        names = records.dtype.names or ()
        yield from (f"record {n} is not finite" for n in names if not np.isfinite(records[n].astype(float)).all())
    draw_order(triangles, np.array([m.alpha_cutoff is not None for m in scene.materials]))
    yield from _of_views(scene, triangles)


def _of_tree(triangles: Triangles) -> Iterator[str]:
    tree = scene_tree(triangles, build_bvh)
    if not np.array_equal(np.sort(tree.order), np.arange(len(triangles.indices))):
        yield "the tree's order is no permutation"
    child = tree.nodes["child"]
    first, count = leaf_range(child[is_leaf(child)])
    if (first + count > len(tree.order)).any() or (child[is_inner(child)] >= len(tree.nodes)).any():
        yield "the tree refers to what is not there"
    if not all(np.isfinite(corner).all() for corner in child_boxes(tree.nodes)):
        yield "a box of the tree is not finite"


def _of_views(scene: Scene, triangles: Triangles) -> Iterator[str]:
    box = bounds(triangles)
    of_scene = scene_facts(scene, *box)
    for view in viewpoints(scene, box):
        settings = focused(Settings(), view)
        facts = frame_facts(of_scene, view.camera, settings.lens, (960, 540), near_plane(*box))
        if not (math.isfinite(facts.near_coc_px) and math.isfinite(facts.far_coc_px)):
            yield f"{view} has no circle of confusion"
    for moving in triangles.moving:
        if not all(np.isfinite(moving.motion.displacement(t)).all() for t in (0.0, 0.37, 1e6)):
            yield f"{moving.motion.name!r} moves nowhere"


def _numbers(value: Any, where: str) -> Iterator[tuple[str, Any]]:
    """Every float of a value made of dataclasses, tuples and arrays, with what it is called."""
    if is_dataclass(value):
        for field in fields(value):
            yield from _numbers(getattr(value, field.name), field.name)
    elif isinstance(value, tuple):
        for item in value:
            yield from _numbers(item, where)
    elif isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
        yield where, value


def _sound(where: str, value: Any) -> bool:
    return bool(np.isfinite(value).all()) or where in MAY_BE_INFINITE


def _texts(value: Any) -> Iterator[str]:
    if is_dataclass(value):
        for field in fields(value):
            if field.name != "source":  # the path as the user gave it
                yield from _texts(getattr(value, field.name))
    elif isinstance(value, tuple):
        for item in value:
            yield from _texts(item)
    elif isinstance(value, str):
        yield value


class _Printed:
    """What is written to the process's standard error meanwhile, by whomever."""

    def __enter__(self) -> _Printed:
        self.text = ""
        self._file = tempfile.TemporaryFile()
        self._before = os.dup(2)
        os.dup2(self._file.fileno(), 2)
        return self

    def __exit__(self, *error: object) -> None:
        os.dup2(self._before, 2)
        os.close(self._before)
        self._file.seek(0)
        self.text = self._file.read().decode(errors="replace")
        self._file.close()
