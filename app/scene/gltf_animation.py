"""glTF animations: the key times and values of the nodes that the first one moves. Specification, section 3.11."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import quoted
from . import gltf_accessors as accessors
from .gltf_file import GltfFile, Json
from .model import F64
from .motion import Track, unit_quaternions
from .validate import count

MAX_KEYS = 1 << 20  # of one track: five hours at 60 keys a second
_WIDTHS = {"translation": 3, "rotation": 4}


@dataclass
class Animation:
    """The tracks of each node that moves, by node index, and how long one round takes."""

    tracks: dict[int, dict[str, Track]] = field(default_factory=dict)  # node -> "translation", "rotation" -> track
    period: float = 0.0  # s; 0: nothing moves


def read_animation(file: GltfFile, notes: list[str]) -> Animation:
    """The file's first animation; what is left out of it is told in `notes`. Raises UserError for damaged keys."""
    found = Animation()
    animations = file.json.get("animations", [])
    if not animations:
        return found
    if len(animations) > 1:
        notes.append(f"Of {len(animations)} animations in the file, only the first one plays.")
    animation, left_out, splines = file.item("animations", 0), set(), False
    for channel in animation["channels"]:
        target = channel["target"]
        path, node = target["path"], target.get("node")
        if path not in _WIDTHS:
            left_out.add(str(path))
        elif node is not None:
            if "matrix" in file.item("nodes", node):
                left_out.add("nodes given by a matrix")
                continue
            sampler = animation["samplers"][channel["sampler"]]
            splines |= sampler.get("interpolation") == "CUBICSPLINE"
            track = _track(file, sampler, path)
            found.tracks.setdefault(node, {})[path] = track
            found.period = max(found.period, float(track.times[-1]))
    if left_out:
        kinds = ", ".join(sorted(left_out))
        notes.append(f"Only translations and rotations of nodes are animated; left out: {quoted(kinds)}.")
    if splines:
        notes.append("Cubic-spline animations move in straight lines and arcs between their keys.")
    return found if found.period > 0.0 else _held(found)


def _held(animation: Animation) -> Animation:
    """An animation whose keys all lie at time 0 is a pose: any period serves."""
    return Animation(animation.tracks, 1.0 if animation.tracks else 0.0)


def _track(file: GltfFile, sampler: Json, path: str) -> Track:
    times = accessors.read_floats(file, sampler["input"], (1,))[:, 0].astype(np.float64)
    values = accessors.read_floats(file, sampler["output"], (_WIDTHS[path],)).astype(np.float64)
    method = sampler.get("interpolation", "LINEAR")
    if method == "CUBICSPLINE":
        values = values[1::3]  # each key is stored as in-tangent, value, out-tangent
    elif method not in ("LINEAR", "STEP"):
        raise ValueError(f"{method!r:.40} is no interpolation")
    _check(file, times, values)
    return Track(times, unit_quaternions(values) if path == "rotation" else values, method == "STEP")


def _check(file: GltfFile, times: F64, values: F64) -> None:
    if not 0 < len(times) <= MAX_KEYS:
        raise file.broken(f"has an animation with {count(len(times), 'key')}; 1 to {MAX_KEYS} are allowed")
    if len(values) != len(times):
        raise file.broken(f"has an animation with {len(times)} key times but {len(values)} values")
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise file.broken("has an animation key that is not a finite number")
    if times[0] < 0.0 or (np.diff(times) < 0.0).any():
        raise file.broken("has animation keys whose times are negative or not in order")
