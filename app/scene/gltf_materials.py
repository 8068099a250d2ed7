"""glTF materials, textures and images, with the extensions this renderer honours and a note for each it does not."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ..errors import quoted
from .gltf_file import GltfFile, Json
from .images import decode_all
from .model import Image, Material, TextureSlot, Wrap

_WRAPS: dict[int, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
_NEAREST = {9728, 9984, 9986}  # filters that do not blend texels
_MASK_AT = 0.5  # glTF's default alphaCutoff; stands in for blending too
_HONOURED = {"KHR_materials_emissive_strength", "KHR_materials_pbrSpecularGlossiness", "KHR_materials_unlit"}


@dataclass(frozen=True)
class ReadMaterial:
    """A material and the TEXCOORD set that its textures read."""

    material: Material
    tex_coord: int


@dataclass
class MaterialReader:
    """Reads materials one by one and collects their images; an image used as colour and as data is kept twice."""

    file: GltfFile
    notes: list[str]
    _images: dict[tuple[int, bool], int] = field(default_factory=dict)

    def read(self, index: int) -> ReadMaterial:
        """Material `index` of the file. Raises UserError on a broken reference."""
        source = self.file.item("materials", index)
        name = quoted(source.get("name") or f"material {index}")
        extensions = source.get("extensions", {})
        self._note_extensions(name, source, extensions)
        pbr, metallic, roughness = self._surface(source, extensions, name)
        strength = float(extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0))
        emissive = _numbers(source.get("emissiveFactor", (0, 0, 0)), 3)
        normal = source.get("normalTexture")
        infos = (
            pbr.get("baseColorTexture"),
            pbr.get("metallicRoughnessTexture"),
            normal,
            source.get("emissiveTexture"),
        )
        base, rough, bumps, glow = (
            self._slot(info, srgb) for info, srgb in zip(infos, (True, False, False, True), strict=True)
        )
        color = _numbers(pbr.get("baseColorFactor", (1, 1, 1, 1)), 4)
        material = Material(
            base_color=color,  # type: ignore[arg-type]
            metallic=metallic,
            roughness=roughness,
            emissive=tuple(strength * e for e in emissive),  # type: ignore[arg-type]
            normal_scale=float((normal or {}).get("scale", 1.0)),
            alpha_cutoff=self._cutoff(source, color[3], base is not None, name),
            base_color_texture=base,
            metallic_roughness_texture=rough,
            normal_texture=bumps,
            emissive_texture=glow if any(emissive) else None,
            name=name,
        )
        return ReadMaterial(material, self._tex_coord(infos, name))

    def images(self) -> tuple[Image, ...]:
        """The decoded images that the materials read so far refer to, in the order of their indices."""
        jobs = [(self._image_bytes(source), srgb, self._image_name(source)) for source, srgb in self._images]
        return decode_all(jobs, str(self.file.path))

    def _surface(self, source: Json, extensions: Json, name: str) -> tuple[Json, float, float]:
        """(base colour and its textures, metallic, roughness), translated if the material is specular-glossiness."""
        old = extensions.get("KHR_materials_pbrSpecularGlossiness")
        if old is None or "pbrMetallicRoughness" in source:
            pbr = source.get("pbrMetallicRoughness", {})
            return pbr, float(pbr.get("metallicFactor", 1.0)), float(pbr.get("roughnessFactor", 1.0))
        self.notes.append(f"Material {name!r}: specular-glossiness was read as a non-metal with the same glossiness.")
        pbr = {"baseColorFactor": old.get("diffuseFactor", (1, 1, 1, 1)), "baseColorTexture": old.get("diffuseTexture")}
        return pbr, 0.0, 1.0 - float(old.get("glossinessFactor", 1.0))

    def _slot(self, info: Json | None, srgb: bool) -> TextureSlot | None:
        if info is None:
            return None
        texture = self.file.item("textures", info["index"])
        source = texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source", texture.get("source"))
        if source is None:
            self.notes.append("A texture in a format that is not supported (KTX2, DDS) was left out.")
            return None
        self.file.item("images", source)
        sampler = self.file.item("samplers", texture["sampler"]) if "sampler" in texture else {}
        if {sampler.get("magFilter"), sampler.get("minFilter")} & _NEAREST:
            self.notes.append("A texture that asks for nearest-texel filtering is filtered smoothly.")
        return TextureSlot(
            self._images.setdefault((source, srgb), len(self._images)),
            _WRAPS[sampler.get("wrapS", 10497)],
            _WRAPS[sampler.get("wrapT", 10497)],
            _uv_transform(info.get("extensions", {}).get("KHR_texture_transform", {})),
        )

    def _cutoff(self, source: Json, alpha: float, textured: bool, name: str) -> float | None:
        mode = source.get("alphaMode", "OPAQUE")
        if mode == "OPAQUE":
            return None
        if mode == "BLEND":
            self.notes.append(f"Material {name!r}: alpha blending is drawn as a mask at {_MASK_AT}.")
        cutoff = _MASK_AT if mode == "BLEND" else float(source.get("alphaCutoff", _MASK_AT))
        solid = cutoff <= 0.0 or (not textured and alpha >= cutoff)
        return None if solid else cutoff

    def _tex_coord(self, infos: tuple[Json | None, ...], name: str) -> int:
        """The set of the base colour, else of the first texture: a vertex carries one pair of coordinates."""
        sets = [
            int(info.get("extensions", {}).get("KHR_texture_transform", {}).get("texCoord", info.get("texCoord", 0)))
            for info in infos
            if info is not None
        ]
        if len(set(sets)) > 1:
            self.notes.append(f"Material {name!r}: its textures use several coordinate sets; all read set {sets[0]}.")
        return sets[0] if sets else 0

    def _note_extensions(self, name: str, source: Json, extensions: Json) -> None:
        if "KHR_materials_unlit" in extensions:
            self.notes.append(f"Material {name!r} is marked unlit but is lit like the others (use shading.mode unlit).")
        for extension in sorted(set(extensions) - _HONOURED):
            self.notes.append(f"{quoted(extension)} is not supported and was left out.")
        if "occlusionTexture" in source:
            self.notes.append("Baked ambient occlusion textures are not used.")

    def _image_bytes(self, index: int) -> bytes | memoryview:
        image = self.file.item("images", index)
        return self.file.resource(image["uri"]) if "uri" in image else self.file.view(image.get("bufferView"))[0]

    def _image_name(self, index: int) -> str:
        image = self.file.item("images", index)
        uri = str(image.get("uri", ""))
        return quoted(image.get("name") or (uri if uri and not uri.startswith("data:") else f"image {index}"))


def _uv_transform(extension: Json) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """The 2x3 matrix of KHR_texture_transform: scale, then counter-clockwise rotation as seen with v down, then offset.

    The sign is that of the specification's worked example (offset (0, 1), pi/2, scale 0.5: the lower left quadrant) and
    of the large viewers; the GLSL fragment printed in the specification's first draft turned the other way.
    """
    (sx, sy), (ox, oy) = (
        _numbers(extension.get(key, default), 2) for key, default in (("scale", (1, 1)), ("offset", (0, 0)))
    )
    angle = float(extension.get("rotation", 0.0))
    c, s = math.cos(angle), math.sin(angle)
    return (c * sx, s * sy, ox), (-s * sx, c * sy, oy)


def _numbers(values: object, length: int) -> tuple[float, ...]:
    numbers = tuple(float(v) for v in values)  # type: ignore[attr-defined]
    if len(numbers) != length or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{length} finite numbers expected, got {values!r:.60}")
    return numbers
