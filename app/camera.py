"""The camera as a value: where the lens is, where it looks, and the matrices that follow. The only importer of pyrr.

Matrices are row-major float64 acting on column vectors; pyrr's row-vector results are transposed here and nowhere else.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pyrr import matrix44, vector3

from .errors import UserError
from .files import write_text
from .settings import Lens

Array = NDArray[np.float64]
Vec3 = tuple[float, float, float]

STRAIGHT = 0.9999  # |cos| between view direction and up above which `up` is replaced: look-at would be undefined


@dataclass(frozen=True)
class Camera:
    """A pinhole's pose and field of view; focus and aperture live in the lens settings."""

    eye: Vec3 = (0.0, 1.0, 4.0)  # m
    forward: Vec3 = (0.0, 0.0, -1.0)  # unit
    up: Vec3 = (0.0, 1.0, 0.0)  # unit, not parallel to forward
    fov_y: float = math.radians(45.0)

    @property
    def right(self) -> Vec3:
        """Unit vector to the right of the image."""
        return _vec(vector3.normalise(np.cross(self.forward, self.up)))

    @property
    def true_up(self) -> Vec3:
        """Unit vector up the image."""
        return _vec(np.cross(self.right, self.forward))

    def view(self) -> Array:
        """World to view space, -z forward (4, 4)."""
        eye, forward = np.asarray(self.eye, float), np.asarray(self.forward, float)
        up = np.asarray(safe_up(self.forward, self.up), float)
        return np.asarray(matrix44.create_look_at(eye, eye + forward, up, dtype=float).T)

    def moved(self, right: float, up: float, forward: float) -> Camera:
        """Translated by metres along its own right and forward axes and the world's up."""
        shift = right * np.asarray(self.right) + forward * np.asarray(self.forward) + up * np.asarray((0.0, 1.0, 0.0))
        return replace(self, eye=_vec(np.asarray(self.eye) + shift))

    def turned(self, yaw: float, pitch: float) -> Camera:
        """Turned left by `yaw` and up by `pitch` [rad] about the world's up, stopping short of straight up and down."""
        forward = np.asarray(self.forward, float)
        elevation = math.asin(float(np.clip(forward[1], -1.0, 1.0)))
        azimuth = math.atan2(-forward[0], -forward[2]) + yaw
        elevation = float(np.clip(elevation + pitch, -1.553, 1.553))  # 89 degrees
        c = math.cos(elevation)
        return replace(
            self, forward=(-math.sin(azimuth) * c, math.sin(elevation), -math.cos(azimuth) * c), up=(0.0, 1.0, 0.0)
        )


class Moment(NamedTuple):
    """From where a frame is seen, and when."""

    camera: Camera
    time_s: float  # of the scene's motion; 0 where nothing ever moves


@dataclass(frozen=True)
class Viewpoint:
    """A camera with the focus and aperture its file may carry."""

    camera: Camera
    focus_distance: float | None = None  # m
    aperture: float | None = None  # m
    name: str = ""


def look_at(eye: Vec3, target: Vec3, up: Vec3 = (0.0, 1.0, 0.0), fov_y_deg: float = 45.0) -> Camera:
    """A camera at `eye` looking at `target`. Raises UserError if they coincide or a number is unusable."""
    numbers = np.asarray([*eye, *target, *up, fov_y_deg], float)
    if not np.isfinite(numbers).all():
        raise UserError("the camera has a number that is not finite")
    direction = np.subtract(target, eye)
    distance = math.hypot(*direction)
    if not math.isfinite(distance):
        raise UserError("the camera's eye and target are too far apart")
    if distance < 1e-12:
        raise UserError("the camera's eye and target coincide; give a target in front of it")
    if not 0.0 < fov_y_deg < 180.0:
        raise UserError(f"the camera's field of view is {fov_y_deg:g} degrees; give a value between 0 and 180")
    forward = _vec(direction / distance)
    return Camera(_vec(np.asarray(eye, float)), forward, safe_up(forward, up), math.radians(fov_y_deg))


def safe_up(forward: Vec3, up: Vec3) -> Vec3:
    """`up` as a unit vector, or the axis least along `forward` where `up` is zero or parallel to it."""
    vector = np.asarray(up, float)
    length = float(np.linalg.norm(vector))
    if length > 0.0 and abs(float(np.dot(vector / length, forward))) < STRAIGHT:
        return _vec(vector / length)
    return _vec(np.eye(3)[int(np.argmin(np.abs(forward)))])


def projection(fov_y: float, aspect: float, near: float) -> Array:
    """Perspective projection with an infinite far plane (4, 4): clip z is -near at the near plane and tends to w."""
    f = 1.0 / math.tan(fov_y / 2.0)
    return np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0], [0, 0, -1, -2 * near], [0, 0, -1, 0]], float)


def offset(jitter_px: tuple[float, float], size: tuple[int, int]) -> Array:
    """A clip-space shift that moves the sample position by `jitter_px` within each pixel (multiplies from the left)."""
    matrix = np.eye(4)
    matrix[0, 3], matrix[1, 3] = -2.0 * jitter_px[0] / size[0], -2.0 * jitter_px[1] / size[1]
    return matrix


def lens_shear(lens_m: tuple[float, float], focus_distance: float) -> Array:
    """View space seen from the lens point (x, y) [m] with the focal plane kept in place (4, 4).

    The eye moves by (x, y), which shifts a point at depth z by -(x, y); shearing by z/d moves it back exactly on the
    plane z = d.
    """
    matrix = np.eye(4)
    matrix[0, 3], matrix[1, 3] = -lens_m[0], -lens_m[1]
    matrix[0, 2], matrix[1, 2] = -lens_m[0] / focus_distance, -lens_m[1] / focus_distance
    return matrix


def read_viewpoint(path: str | Path) -> Viewpoint:
    """A camera file (JSON: eye, target, up, fov_y_deg, and optionally focus_distance, aperture). Raises UserError."""
    path = Path(path)
    try:
        values = json.loads(path.read_text())
    except OSError as error:
        raise UserError(f"camera file {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise UserError(f"camera file {path} is not JSON: {error}") from None
    try:
        eye, target, up = _vector(values["eye"]), _vector(values["target"]), _vector(values.get("up", (0.0, 1.0, 0.0)))
        fov_y_deg = float(values.get("fov_y_deg", 45.0))
        focus_distance, aperture = _lens_value(values, "focus_distance"), _lens_value(values, "aperture")
        return Viewpoint(look_at(eye, target, up, fov_y_deg), focus_distance, aperture, path.stem)
    except UserError as error:
        raise UserError(f"camera file {path}: {error}") from None
    except (TypeError, ValueError, KeyError, AttributeError, OverflowError):
        raise UserError(
            f'camera file {path} needs "eye" and "target" as three numbers each (and "up", "fov_y_deg", '
            '"focus_distance", "aperture" as numbers if given)'
        ) from None


def _vector(values: list[float]) -> Vec3:
    if isinstance(values, str):
        raise ValueError(values)
    x, y, z = map(float, values)
    return (x, y, z)


def _lens_value(values: dict[str, float | None], key: str) -> float | None:
    """A lens setting that the file may carry; it must lie in that setting's range."""
    if (given := values.get(key)) is None:
        return None
    value, range_ = float(given), Lens.__dataclass_fields__[key].metadata
    if not range_["low"] <= value <= range_["high"]:
        raise UserError(f"{key} is {value:g}; give a value from {range_['low']:g} to {range_['high']:g}")
    return value


def camera_values(camera: Camera) -> dict[str, Any]:
    """A camera as camera files and picture metadata hold it."""
    return {
        "eye": list(camera.eye),
        "target": [e + f for e, f in zip(camera.eye, camera.forward, strict=True)],
        "up": list(camera.up),
        "fov_y_deg": math.degrees(camera.fov_y),
    }


def write_viewpoint(path: str | Path, view: Viewpoint) -> None:
    """Write a camera file that `read_viewpoint` reads back. Raises UserError."""
    values = {**camera_values(view.camera), "focus_distance": view.focus_distance, "aperture": view.aperture}
    write_text(path, json.dumps({k: v for k, v in values.items() if v is not None}, indent=1) + "\n")


def _vec(array: Array) -> Vec3:
    x, y, z = (float(a) for a in array)
    return (x, y, z)
