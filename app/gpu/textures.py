"""The scene's images as texture arrays: a few size classes, colour apart from data, every image one layer.

OpenGL 4.3 cannot index samplers by a value that differs between pixels, but it can index layers: so images are
resampled to the side of their class and a material names (class, layer). Colour is stored as linear float16, because
filtering must happen in linear light and moderngl offers no sRGB array format; data (normals, metallic-roughness) stays
8 bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
import PIL.Image
from numpy.typing import NDArray

from ..errors import UserError
from ..scene.model import LARGEST_IMAGE_PX, Image, TextureSlot
from ..tone import srgb_decode

CLASS_SIZES = (256, 1024, LARGEST_IMAGE_PX)  # px per side: icons and tiles, ordinary maps, hero maps
NO_TEXTURE = 0xFFFFFFFF
_WRAP = {"repeat": 0, "mirror": 1, "clamp": 2}
_BYTES_PER_CHANNEL = {"f1": 1, "f2": 2}


@dataclass(frozen=True)
class Place:
    """Where an image went."""

    size_class: int
    layer: int


def size_class(image: Image, limit: int) -> int:
    """The smallest class that loses no detail, or the largest whose side the device allows."""
    allowed = [i for i, size in enumerate(CLASS_SIZES) if size <= limit]
    longest = max(image.pixels.shape[:2])
    return next((i for i in allowed if CLASS_SIZES[i] >= longest), allowed[-1])


def slot_bits(slot: TextureSlot | None, places: Sequence[Place]) -> int:
    """A material's texture slot as the shader reads it: size class, layer, wrap modes (app/gpu/layout.py)."""
    if slot is None:
        return NO_TEXTURE
    place = places[slot.image]
    return place.size_class << 24 | _WRAP[slot.wrap_v] << 18 | _WRAP[slot.wrap_u] << 16 | place.layer


_LINEAR = srgb_decode(np.arange(256) / 255.0).astype(np.float32)
_PLAIN = (np.arange(256) / 255.0).astype(np.float32)


def color_layer(image: Image, side: int) -> NDArray[np.float16]:
    """(side, side, 4) linear colour and alpha, resampled in linear light."""
    layer = np.empty((side, side, 4), np.float16)
    for channel in range(4):
        decode = _LINEAR if image.srgb and channel < 3 else _PLAIN
        layer[..., channel] = _resampled(decode[image.pixels[..., channel]], side)
    return layer


def data_layer(image: Image, side: int) -> NDArray[np.uint8]:
    """(side, side, 4) values as stored."""
    if image.pixels.shape[:2] == (side, side):
        return image.pixels
    return np.asarray(PIL.Image.fromarray(image.pixels).resize((side, side), PIL.Image.Resampling.BILINEAR))


def _resampled(channel: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    if channel.shape == (side, side):
        return channel
    picture = PIL.Image.fromarray(channel)  # Pillow's bilinear widens its filter when it shrinks, so it does not alias
    return np.asarray(picture.resize((side, side), PIL.Image.Resampling.BILINEAR))


class SceneTextures:
    """Owns the arrays. `samplers` holds scene_color_0.. and scene_data_0..; `defines` says which the shaders need."""

    def __init__(self, ctx: moderngl.Context, images: Sequence[Image], textured: bool) -> None:
        limit, layers = ctx.info["GL_MAX_TEXTURE_SIZE"], ctx.info["GL_MAX_ARRAY_TEXTURE_LAYERS"]
        members: dict[tuple[bool, int], list[int]] = {}
        places = []
        for index, image in enumerate(images):
            group = members.setdefault((image.srgb, size_class(image, limit)), [])
            places.append(Place(size_class(image, limit), len(group)))
            group.append(index)
        if members and (most := max(map(len, members.values()))) > layers:
            raise UserError(f"the scene has {most} images of similar size, but the device allows {layers}: remove some")
        self.places: tuple[Place, ...] = tuple(places)
        self.samplers = {
            f"scene_{'color' if srgb else 'data'}_{kind}": _array(ctx, [images[i] for i in group], CLASS_SIZES[kind])
            for (srgb, kind), group in members.items()
        }
        self.defines = {
            "COLOR_CLASSES": sum(1 << kind for srgb, kind in members if srgb) if textured else 0,
            "DATA_CLASSES": sum(1 << kind for srgb, kind in members if not srgb) if textured else 0,
            **{f"CLASS_SIZE_{i}": size for i, size in enumerate(CLASS_SIZES)},
        }

    @property
    def bytes(self) -> int:
        """All levels of all arrays."""
        texels = {t: t.width * t.height * t.layers * 4 // 3 for t in self.samplers.values()}  # with mipmaps
        return sum(4 * _BYTES_PER_CHANNEL[t.dtype] * count for t, count in texels.items())

    def release(self) -> None:
        """Free the arrays."""
        for texture in self.samplers.values():
            texture.release()
        self.samplers.clear()


def _array(ctx: moderngl.Context, images: Sequence[Image], side: int) -> moderngl.TextureArray:
    srgb = images[0].srgb
    texture = ctx.texture_array((side, side, len(images)), 4, dtype="f2" if srgb else "f1")
    for layer, image in enumerate(images):
        pixels = color_layer(image, side) if srgb else data_layer(image, side)
        texture.write(np.ascontiguousarray(pixels).tobytes(), viewport=(0, 0, layer, side, side, 1))
    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = True
    return texture
