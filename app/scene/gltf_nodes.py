"""The glTF node graph: world transforms, what moves them, and the cameras and lights on it (KHR_lights_punctual)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..camera import target_of, unit
from ..errors import quoted
from .gltf_animation import Animation
from .gltf_file import GltfFile, Json
from .model import F64, Light, SceneCamera
from .motion import Joint, Motion, Track, rotation_matrices, still, unit_quaternions

_KINDS = {"directional": "sun", "point": "point", "spot": "spot"}
# Ratio of the scales along two axes beyond which the way back into a moving space is lost to float32.
WORST_CONDITION = 1e5
_NO_ROTATION = np.eye(3)
MAX_JOINTS = 64  # animated nodes above one another: twice what an animal's skeleton has


class Node(NamedTuple):
    """A node with its world transform at time 0, row-major on column vectors."""

    json: Json
    world: F64  # (4, 4)
    motion: Motion | None = None  # displaces it from there; None: it stands still


class _Place(NamedTuple):
    """Where the children of a node hang: at rest relative to the world, or to the innermost moving node above."""

    world: F64  # (4, 4) at time 0
    rest: F64  # (4, 4) to the moving node's space, or to the world
    motion: Motion | None


def walk(file: GltfFile, animation: Animation, notes: list[str]) -> Iterator[Node]:
    """All nodes of the default scene, parents first; UserError on a cycle or a node with two parents."""
    seen: set[int] = set()
    rotations = _rotations(file.json.get("nodes", []))
    pending = [(root, _Place(np.eye(4), np.eye(4), None)) for root in reversed(_roots(file))]
    while pending:
        index, parent = pending.pop()
        node = file.item("nodes", index)
        if index in seen:
            raise file.broken(f"reaches nodes[{index}] twice, so its node graph is no tree")
        seen.add(index)
        with np.errstate(over="ignore", invalid="ignore"):  # an infinite place is refused later, by validate
            local = _local(file, node, rotations.get(index, _NO_ROTATION))
            place = _Place(parent.world @ local, parent.rest @ local, parent.motion)
            if tracks := animation.tracks.get(index):
                place = _moving(node, tracks, animation.period, parent, notes)
        yield Node(node, place.world, place.motion)
        pending += [(child, place) for child in reversed(node.get("children", []))]


def _moving(node: Json, tracks: dict[str, Track], period: float, parent: _Place, notes: list[str]) -> _Place:
    """The place of an animated node; one that cannot be followed stays at its pose of time 0."""
    joint = Joint(
        parent.rest,
        tracks.get("translation") or still(_vector(node.get("translation", (0, 0, 0)), 3)),
        tracks.get("rotation") or still(unit_quaternions([_vector(node.get("rotation", (0, 0, 0, 1)), 4)])[0]),
        _vector(node.get("scale", (1, 1, 1)), 3),
    )
    above = parent.motion.joints if parent.motion else ()
    pose = joint.pose(np.zeros(1))[0]
    world = parent.world @ pose
    followed = np.isfinite(world).all() and np.linalg.cond(world[:3, :3]) <= WORST_CONDITION
    if followed and len(above) < MAX_JOINTS:
        return _Place(world, np.eye(4), Motion((*above, joint), period, quoted(node.get("name", ""))))
    notes.append(f"Animated nodes that are scaled flat, far off or below {MAX_JOINTS} others do not move themselves.")
    return _Place(world, parent.rest @ pose, parent.motion)


def _roots(file: GltfFile) -> list[int]:
    if file.json.get("scenes"):
        return list(file.item("scenes", file.json.get("scene", 0)).get("nodes", []))
    nodes = file.json.get("nodes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [index for index in range(len(nodes)) if index not in children]
    if nodes and not roots:
        raise file.broken("has a cycle in its node graph")
    return roots


def _rotations(nodes: list[Json]) -> dict[int, F64]:
    """(3, 3) rotations of the nodes that have one, by index: all at once, since there may be 100 000."""
    given = {index: _vector(node["rotation"], 4) for index, node in enumerate(nodes) if "rotation" in node}
    if not given:
        return {}
    quaternions = unit_quaternions(np.stack([*given.values()]))  # exporters round
    return dict(zip(given, rotation_matrices(quaternions)))


def _local(file: GltfFile, node: Json, rotation: F64) -> F64:
    if "matrix" in node:
        local = _vector(node["matrix"], 16).reshape(4, 4).T  # stored column by column
        if not np.array_equal(local[3], (0.0, 0.0, 0.0, 1.0)):
            raise file.broken("has a node matrix that is not affine")
    else:
        local = np.eye(4)
        local[:3, :3] = rotation * _vector(node.get("scale", (1, 1, 1)), 3)
        local[:3, 3] = _vector(node.get("translation", (0, 0, 0)), 3)
    if not np.isfinite(local).all():
        raise file.broken("has a node transform that is not finite")
    return local


def _vector(values: Any, length: int) -> F64:
    vector = np.asarray(values, np.float64)
    if vector.shape != (length,) or not np.isfinite(vector).all():  # null becomes NaN
        raise ValueError(f"{length} numbers expected, got {values!r:.60}")
    return vector


def _direction(world: F64, local: tuple[float, float, float]) -> F64:
    """World direction of a node's local axis, unit; scale means nothing to cameras and lights (spec, 3.10)."""
    with np.errstate(over="ignore", invalid="ignore"):  # a place that is not finite is left out later, by bounded
        vector = unit(world[:3, :3] @ np.asarray(local))
    return vector if vector.any() else np.asarray(local)


def read_camera(file: GltfFile, node: Node, notes: list[str]) -> SceneCamera | None:
    """The perspective camera on a node; focus and aperture come from the camera's `extras` if given there in metres."""
    camera = file.item("cameras", node.json["camera"])
    name = quoted(camera.get("name") or node.json.get("name", ""))
    if camera.get("type") != "perspective":
        notes.append(f"Camera {name!r} is not perspective and was dropped.")
        return None
    fov = float(camera["perspective"]["yfov"])
    if not 0.0 < fov < math.pi:
        raise file.broken(f"has camera {name!r} with a field of view of {fov} rad")
    extras = camera.get("extras")
    extras = extras if isinstance(extras, dict) else {}
    focus, aperture = _positive(extras.get("focus_distance")), _positive(extras.get("aperture"), zero=True)
    eye, forward = _triple(node.world[:3, 3]), _triple(_direction(node.world, (0.0, 0.0, -1.0)))
    up = _triple(_direction(node.world, (0.0, 1.0, 0.0)))
    return SceneCamera(eye, target_of(eye, forward), up, math.degrees(fov), focus, aperture, name)


def _positive(value: object, zero: bool = False) -> float | None:
    """The number if it is a usable length, else None: `extras` are anybody's, so odd ones are ignored."""
    usable = isinstance(value, int | float) and math.isfinite(value) and (value > 0 or (zero and value == 0))
    return float(value) if usable else None  # type: ignore[arg-type]


def read_light(file: GltfFile, node: Node) -> Light | None:
    """The KHR_lights_punctual light on a node, in world space; None if the node carries none or it is black."""
    reference = node.json.get("extensions", {}).get("KHR_lights_punctual")
    if reference is None:
        return None
    lights = file.json.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    index = reference["light"]
    if not 0 <= index < len(lights):
        raise file.broken(f"refers to light {index}, which does not exist")
    light, spot = lights[index], lights[index].get("spot", {})
    color, intensity = _vector(light.get("color", (1, 1, 1)), 3), float(light.get("intensity", 1.0))
    if not math.isfinite(intensity) or color.min() < 0.0 or intensity < 0.0:
        raise file.broken(f"has light {index} with a negative or infinite strength")
    if not (intensity and color.any()):
        return None
    return Light(
        _KINDS[light["type"]],  # type: ignore[arg-type]
        _triple(color),
        intensity,
        _triple(node.world[:3, 3]),
        _triple(_direction(node.world, (0.0, 0.0, -1.0))),
        _positive(light.get("range")) or math.inf,
        float(spot.get("innerConeAngle", 0.0)),
        float(spot.get("outerConeAngle", math.pi / 4)),
    )


def _triple(vector: F64) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
