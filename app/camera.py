"""The camera as a value: where the lens is, where it looks, and the matrices that follow. The only importer of pyrr.

Matrices are row-major float64 acting on column vectors; pyrr's row-vector results are transposed here and nowhere else.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pyrr import matrix44, vector3

from .errors import UserError
from .files import write_text
from .settings import Lens

Array = NDArray[np.float64]
Vec3 = tuple[float, float, float]

FARTHEST_M = 1e10  # an eye's coordinates: from there the largest scene, of 1e9 m either way, fits into a picture
# Vertical fields of view [degrees]. Below, a pixel of a picture 1080 px high would span less than 14 of the steps in
# which float32 tells directions apart (2^-23 rad); above, the outer half of the picture would show the last degree.
FOV_Y_DEG = (0.1, 179.0)
STRAIGHT = 1e-6  # sine of the angle between view direction and up below which `up` is replaced: it says nothing more
STEEPEST = math.radians(89.0)  # elevation at which turning up or down stops


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

    @property
    def axes(self) -> Array:
        """(3, 3) right, up and back in the image, rows, in world axes; not to be written to."""
        return _axes(self.forward, self.up)

    def view(self) -> Array:
        """World to view space, -z forward (4, 4)."""
        view = np.eye(4)
        # Turned about the origin, then moved: a target made as eye + forward would lose as many digits as the eye has.
        view[:3, :3] = self.axes
        view[:3, 3] = -self.axes @ np.asarray(self.eye, float)
        return view

    def moved(self, right: float, up: float, forward: float) -> Camera:
        """Translated by metres along its own right and forward axes and the world's up, as far as there is a world."""
        shift = right * np.asarray(self.right) + forward * np.asarray(self.forward) + up * np.asarray((0.0, 1.0, 0.0))
        return replace(self, eye=_vec(np.clip(np.asarray(self.eye) + shift, -FARTHEST_M, FARTHEST_M)))

    def turned(self, yaw: float, pitch: float) -> Camera:
        """Turned left by `yaw` and up by `pitch` [rad] about the world's up, stopping short of straight up and down."""
        elevation = math.asin(float(np.clip(self.forward[1], -1.0, 1.0)))
        # Beyond the steepest, the heading is what is up in the picture, or down in it for who looks up.
        steep = abs(elevation) > STEEPEST
        ahead = np.asarray(self.true_up) * -math.copysign(1.0, elevation) if steep else np.asarray(self.forward)
        azimuth = math.atan2(-ahead[0], -ahead[2]) + yaw
        elevation = float(np.clip(elevation + pitch, -STEEPEST, STEEPEST))
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
    if max(map(abs, eye)) > FARTHEST_M:
        raise UserError(f"the camera's eye is farther out than any scene; give coordinates up to {FARTHEST_M:g} m")
    direction = np.subtract(target, eye)
    distance = math.hypot(*direction)
    if not math.isfinite(distance):
        raise UserError("the camera's eye and target are too far apart")
    if distance < 1e-12:
        raise UserError("the camera's eye and target coincide; give a target in front of it")
    narrowest, widest = FOV_Y_DEG
    if not narrowest <= fov_y_deg <= widest:
        raise UserError(
            f"the camera's field of view is {fov_y_deg:g} degrees; give a value from {narrowest:g} to {widest:g}"
        )
    forward = _vec(direction / distance)
    return Camera(_vec(np.asarray(eye, float)), forward, safe_up(forward, up), math.radians(fov_y_deg))


@lru_cache(maxsize=8)  # a frame asks for the same few several times
def _axes(forward: Vec3, up: Vec3) -> Array:
    look = matrix44.create_look_at(np.zeros(3), np.asarray(forward, float), safe_up(forward, up), dtype=float)
    axes = np.ascontiguousarray(look.T[:3, :3])
    axes.flags.writeable = False
    return axes


def safe_up(forward: Vec3, up: Vec3) -> Vec3:
    """`up` as a unit vector, or the axis least along `forward` where `up` is zero or parallel to it."""
    vector = unit(up)
    if np.linalg.norm(np.cross(forward, vector)) > STRAIGHT:
        return _vec(vector)
    return _vec(np.eye(3)[int(np.argmin(np.abs(forward)))])


def unit(vector: ArrayLike) -> Array:
    """The vector (3,) at length 1, whatever its length; zero stays zero."""
    vector = np.asarray(vector, float)
    longest = np.abs(vector).max()
    if longest == 0.0:
        return vector
    scaled = vector / longest  # neither too long nor too short to square
    return np.asarray(scaled / np.linalg.norm(scaled))


def target_of(eye: Vec3, forward: Vec3) -> Vec3:
    """A place straight ahead: a metre away, or as far as the eye is out, where a metre would round the direction."""
    return _vec(np.asarray(eye, float) + max(1.0, *map(abs, eye)) * np.asarray(forward, float))


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
        "target": list(target_of(camera.eye, camera.forward)),
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
