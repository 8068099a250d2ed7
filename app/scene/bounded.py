"""Numbers that a file gives to materials, lights and cameras, brought to where the arithmetic that follows is safe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..camera import look_at
from ..errors import UserError
from .decoded import Decoded
from .model import Environment, Light, Material, SceneCamera, TextureSlot
from .validate import MAX_COORDINATE

MAX_RADIANCE = 1e9  # the sun's disc, in candela a square metre; its square still fits into float32
MAX_NORMAL_SCALE = 1e3  # a slope that leaves nothing of the normal
MAX_CUTOFF = 2.0  # above 1 nothing is left of a masked surface
MAX_TEXTURE_SCALE = 1e6  # repetitions a coordinate
MIN_LIGHT_RANGE = 1e-6  # m


def bound(decoded: Decoded) -> None:
    """Bring all numbers into range, in place, with a note where one was not; leave out what cannot be used."""
    materials = [_material(material) for material in decoded.materials]
    for before, after in zip(decoded.materials, materials):
        if after != before:
            decoded.notes.append(f"Material {after.name!r} had numbers out of range, which were brought into it.")
    decoded.materials = materials
    decoded.lights = [_light(light) for light in decoded.lights if _near(light.position, "A light", decoded.notes)]
    decoded.cameras = [camera for camera in decoded.cameras if _usable(camera, decoded.notes)]
    environment = decoded.environment
    sky, ground = (_color(c, MAX_RADIANCE) for c in (environment.sky, environment.ground))
    decoded.environment = Environment(sky, ground)


def _material(m: Material) -> Material:
    red, green, blue, alpha = m.base_color
    return replace(
        m,
        base_color=(*_color((red, green, blue), 1.0), _clip(alpha, 0.0, 1.0)),
        metallic=_clip(m.metallic, 0.0, 1.0),
        roughness=_clip(m.roughness, 0.0, 1.0),
        emissive=_color(m.emissive, MAX_RADIANCE),
        normal_scale=_clip(m.normal_scale, -MAX_NORMAL_SCALE, MAX_NORMAL_SCALE),
        alpha_cutoff=None if m.alpha_cutoff is None else _clip(m.alpha_cutoff, 0.0, MAX_CUTOFF),
        base_color_texture=_slot(m.base_color_texture),
        metallic_roughness_texture=_slot(m.metallic_roughness_texture),
        normal_texture=_slot(m.normal_texture),
        emissive_texture=_slot(m.emissive_texture),
    )


def _slot(slot: TextureSlot | None) -> TextureSlot | None:
    if slot is None:
        return None
    (a, b, c), (d, e, f) = slot.uv_transform
    a, b, c, d, e, f = (_clip(x, -MAX_TEXTURE_SCALE, MAX_TEXTURE_SCALE) for x in (a, b, c, d, e, f))
    return replace(slot, uv_transform=((a, b, c), (d, e, f)))


def _light(light: Light) -> Light:
    color = _color(light.color, MAX_RADIANCE)
    return replace(
        light,
        color=color,
        intensity=_clip(light.intensity, 0.0, MAX_RADIANCE / max(1.0, *color)),
        range=max(light.range, MIN_LIGHT_RANGE),
        inner_cone=_clip(light.inner_cone, 0.0, math.pi),
        outer_cone=_clip(light.outer_cone, 0.0, math.pi),
    )


def _usable(camera: SceneCamera, notes: list[str]) -> bool:
    if not _near(camera.eye, f"Camera {camera.name!r}", notes):
        return False
    try:
        look_at(camera.eye, camera.target, camera.up, camera.fov_y_deg)
    except UserError as error:
        notes.append(f"Camera {camera.name!r} was left out: {error}.")
        return False
    return True


def _near(place: Sequence[float], what: str, notes: list[str]) -> bool:
    """Whether a place is near enough to the origin; a note where it is not. NaN is not."""
    near = all(abs(x) <= MAX_COORDINATE for x in place)
    if not near:
        notes.append(f"{what} is farther than {MAX_COORDINATE:g} m from the origin and was left out.")
    return near


def _clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def _color(color: tuple[float, float, float], most: float) -> tuple[float, float, float]:
    red, green, blue = (_clip(value, 0.0, most) for value in color)
    return red, green, blue
