"""One definition per GPU struct: a numpy dtype with std430/std140 offsets that prints its own GLSL.

`python -m app.gpu.layout` writes glsl/shared/structs.glsl; a test says when it is stale. Every struct is laid out so
that its std140 and std430 forms coincide (no arrays of scalars, vec3 only before a scalar), so that one dtype serves
uniform and storage blocks.
"""

from __future__ import annotations

import math

import numpy as np

from ..bvh.pack import BVH_NODE_FIELDS
from ..data import data_dir

#: GLSL type -> (numpy base type, shape, alignment in bytes, size in bytes)
_TYPES: dict[str, tuple[str, tuple[int, ...], int, int]] = {
    "float": ("<f4", (), 4, 4),
    "int": ("<i4", (), 4, 4),
    "uint": ("<u4", (), 4, 4),
    "vec2": ("<f4", (2,), 8, 8),
    "ivec2": ("<i4", (2,), 8, 8),
    "uvec2": ("<u4", (2,), 8, 8),
    "vec3": ("<f4", (3,), 16, 12),
    "uvec3": ("<u4", (3,), 16, 12),
    "vec4": ("<f4", (4,), 16, 16),
    "ivec4": ("<i4", (4,), 16, 16),
    "uvec4": ("<u4", (4,), 16, 16),
    "mat4": ("<f4", (4, 4), 16, 64),  # columns first: upload M.T of a row-major matrix
}
_FROM_BITS = {"f": "uintBitsToFloat", "v": "uintBitsToFloat", "i": "int"}  # by the first letter of a GLSL type


def struct(name: str, fields: dict[str, tuple[str, str]], uniform: bool = False) -> np.dtype:
    """The dtype of a GLSL struct. `fields` maps name -> (GLSL type, meaning with unit); `uniform` pads to 16 bytes
    (std140).
    """
    names, formats, offsets, cursor, alignment = [], [], [], 0, 16 if uniform else 4
    for field, (glsl_type, _) in fields.items():
        base, shape, align, size = _TYPES[glsl_type]
        cursor = -(-cursor // align) * align
        names.append(field)
        formats.append((base, shape))
        offsets.append(cursor)
        cursor += size
        alignment = max(alignment, align)
    itemsize = -(-cursor // alignment) * alignment
    layout = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": itemsize})
    return np.dtype(layout, metadata={"glsl_name": name, "glsl_fields": dict(fields)})  # type: ignore[call-overload, no-any-return]


def struct_name(dtype: np.dtype) -> str:
    """The GLSL name of a dtype made by `struct`."""
    return str(dtype.metadata["glsl_name"])  # type: ignore[index]


def struct_fields(dtype: np.dtype) -> dict[str, tuple[str, str]]:
    """Field name -> (GLSL type, meaning) of a dtype made by `struct`."""
    return dict(dtype.metadata["glsl_fields"])  # type: ignore[index]


def print_glsl(dtype: np.dtype) -> str:
    """The GLSL definition, each field with its byte offset and meaning."""
    body = []
    for field, (glsl_type, meaning) in struct_fields(dtype).items():
        offset = dtype.fields[field][1]  # type: ignore[index]
        body.append(f"    {glsl_type} {field};  // @{offset}  {meaning}".rstrip())
    return f"struct {struct_name(dtype)} {{  // {dtype.itemsize} bytes\n" + "\n".join(body) + "\n};\n"


VERTEX = struct(
    "Vertex",
    {
        "px": ("float", "position in the world or, of a moving object, in its own space, m"),
        "py": ("float", ""),
        "pz": ("float", ""),
        "normal": ("uint", "octahedral, snorm16x2"),
        "u": ("float", "texture coordinate, v downwards"),
        "v": ("float", ""),
        "tangent": ("uint", "octahedral, snorm16x2; lowest bit of the high half: handedness is -1"),
        "material": ("uint", "index into the materials; bits 24..: the moving object's, 0 if it stands still"),
    },
)

_SLOT = (
    "texture: size class in bits 24.., layer in bits 0..15, wrap u and v in bits 16..17 and 18..19; NO_TEXTURE if none"
)

MATERIAL = struct(
    "Material",
    {
        "base_color": ("vec4", "linear factor; alpha multiplies the texture's"),
        "emissive": ("vec3", "linear radiance factor, strength included"),
        "alpha_cutoff": ("float", "texels below are holes; 0: opaque"),
        "metallic": ("float", "factor"),
        "roughness": ("float", "factor, perceptual"),
        "normal_scale": ("float", "of the tangent-space xy"),
        "unused": ("float", "padding"),
        "textures": ("uvec4", "base colour, metallic-roughness, normal, emissive: " + _SLOT),
        "uv_base_u": ("vec4", "row of the base colour's uv transform: u' = dot(xyz, (u, v, 1))"),
        "uv_base_v": ("vec4", "v'"),
        "uv_surface_u": ("vec4", "the same for metallic-roughness"),
        "uv_surface_v": ("vec4", ""),
        "uv_normal_u": ("vec4", "the same for the normal map"),
        "uv_normal_v": ("vec4", ""),
        "uv_emissive_u": ("vec4", "the same for emissive"),
        "uv_emissive_v": ("vec4", ""),
    },
)

LIGHT = struct(
    "Light",
    {
        "position": ("vec3", "world, m; unused for a sun"),
        "kind": ("uint", "0 sun, 1 point, 2 spot"),
        "direction": ("vec3", "unit, world, the way the light travels"),
        "inverse_range": ("float", "1/m; 0: unlimited"),
        "intensity": ("vec3", "linear colour times lux (sun) or candela"),
        "spot_scale": ("float", "1 / (cos inner - cos outer)"),
        "spot_offset": ("float", "-cos outer * spot_scale"),
        "casts_shadow": ("uint", "1 for the one sun that the shadow map belongs to"),
        "unused0": ("uint", "padding"),
        "unused1": ("uint", "padding"),
    },
)

FRAME = struct(
    "Frame",
    {
        "view": ("mat4", "world to view (-z forward)"),
        "view_proj": ("mat4", "world to clip, jittered (and sheared for the raster reference)"),
        "view_to_world": ("mat4", "inverse of view"),
        "prev_view_proj": ("mat4", "last frame's world to clip, without jitter"),
        "this_view_proj": ("mat4", "this frame's world to clip, without jitter"),
        "shadow_view_proj": ("mat4", "world to the sun's clip space"),
        "lens_eye": (
            "vec3",
            "the point rays of this raster frame start from: eye, or a lens point in the raster reference, m",
        ),
        "near_plane": ("float", "m"),
        "sky": ("vec3", "linear radiance straight up, or the flat background when unlit"),
        "tan_half_fov_y": ("float", ""),
        "ground": ("vec3", "linear radiance straight down"),
        "aperture": ("float", "lens diameter, m"),
        "size_px": ("vec2", "full resolution"),
        "inverse_size": ("vec2", "1/px"),
        "jitter_px": ("vec2", "sub-pixel offset of this frame's samples from the pixel centre, in -0.5..0.5"),
        "coc_scale_px": ("float", "K of coc_px = K (1/d - 1/z)"),
        "inverse_focus": ("float", "1/d, 1/m; 0 at infinity"),
        "max_coc_px": ("float", "largest CoC radius that the post-process reaches, px"),
        "lens_anamorphic": ("float", "horizontal squeeze of the aperture: x is scaled by 1/this"),
        "lens_rotation": ("float", "rad"),
        "lens_aberration": ("float", "s of the area weight 1 + s(2t - 1), -1..1"),
        "lens_cat_eye": ("float", "shift of the barrel's disc seen from a corner, half lens diameters"),
        "lens_point": ("vec2", "raster reference: this frame's point of the lens, half diameters"),
        "frame_index": ("uint", "counts from 0 at the last history reset"),
        "seed": ("uint", ""),
        "exposure": ("float", "linear factor before tone mapping"),
        "light_count": ("uint", ""),
        "samples_per_frame": ("uint", "traced view: lens samples per pixel added this frame"),
        "slice_begin": ("uint", "traced view: first row of this frame's slice, px"),
        "slice_end": ("uint", "one past its last row"),
        "ray_budget": ("float", "hybrid: mean rays per masked pixel"),
        "max_rays": ("uint", "hybrid: most rays for one pixel"),
        "mask_sensitivity": ("float", "s of the mask's saturating response"),
        "focus_blend": ("float", "width of the near/far split, as CoC radius in px"),
        "history_alpha": ("float", "smallest blend factor of the ray accumulation"),
        "reconstruct_radius": ("float", "radius of the layers' spatial reconstruction, of CoC"),
        "blend_hit_ratio": ("float", "far: rays count below this hit ratio"),
        "blend_specular": ("float", "near: specular luminance at which the post-process wins"),
        "taa_alpha": ("float", "blend factor of the newest frame"),
        "moved": ("uint", "1 if the view or an object moved since last frame"),
        "history_valid": ("uint", "0 right after a reset"),
        "mask_threshold": ("float", "mask responses below get no rays"),
        "mask_variance": ("float", "weight of the rays' deviation in the ray budget"),
        "mask_smoothing": ("float", "standard deviation of the mask's Gaussian, half-res px"),
        "layer_fade_px": ("float", "post-process: CoC difference over which a sample passes from fore- to background"),
        "overlay_range_lo": ("float", "value shown as the colour map's start"),
        "overlay_range_hi": ("float", "value shown as its end"),
    },
    uniform=True,
)

BVH_NODE = struct("BvhNode", BVH_NODE_FIELDS)

OBJECT = struct(
    "Object",
    {
        "to_world": ("mat4", "its own space to the world"),
        "from_world": ("mat4", "the inverse; rays use the linear part only, about to_world's translation"),
        "to_previous": ("mat4", "where a point of the world now was one frame ago"),
        "root": ("uint", "node where its tree begins"),
        "unused0": ("uint", "padding"),
        "unused1": ("uint", "padding"),
        "unused2": ("uint", "padding"),
    },
)

STRUCTS = (VERTEX, MATERIAL, LIGHT, FRAME, BVH_NODE, OBJECT)
RECORDS = (VERTEX, MATERIAL, LIGHT, BVH_NODE, OBJECT)  # of which the scene holds arrays: glsl/shared/records.glsl
STRUCTS_FILE = "shared/structs.glsl"

TEXEL_BYTES = 16
TEXELS_PER_ROW = 4096  # of a texture of records: every device allows four times as many

_RECORDS_IN_TEXTURES = f"""#ifdef RECORDS_IN_TEXTURES
uvec4 record_texel(usampler2D records, uint i) {{
    return texelFetch(records, ivec2(i % {TEXELS_PER_ROW}u, i / {TEXELS_PER_ROW}u), 0);
}}

void read_record(usampler2D records, uint i, out uvec4 record) {{ record = record_texel(records, i); }}
void read_record(usampler2D records, uint i, out vec4 record) {{ record = uintBitsToFloat(record_texel(records, i)); }}
"""


def print_reader(dtype: np.dtype) -> str:
    """The GLSL function that puts record `i` together from the texels that hold its bytes. Whole texels only."""
    name, texels = struct_name(dtype), dtype.itemsize // TEXEL_BYTES
    assert dtype.itemsize % TEXEL_BYTES == 0
    lines = [f"    uvec4 t{k} = record_texel(records, {texels}u * i + {k}u);" for k in range(texels)]
    for field, (glsl_type, _) in struct_fields(dtype).items():
        texel, word = divmod(dtype.fields[field][1] // 4, 4)  # type: ignore[index]
        width = math.prod(_TYPES[glsl_type][1])
        if glsl_type == "mat4":
            value = "mat4(" + ", ".join(f"uintBitsToFloat(t{texel + column})" for column in range(4)) + ")"
        else:
            value = f"t{texel}.{'xyzw'[word : word + width]}"
            value = value if glsl_type.startswith("u") else f"{_FROM_BITS[glsl_type[0]]}({value})"
        lines.append(f"    record.{field} = {value};")
    return f"void read_record(usampler2D records, uint i, out {name} record) {{\n" + "\n".join(lines) + "\n}\n"


def structs_glsl() -> str:
    """The text of glsl/shared/structs.glsl."""
    header = "// Made by `python -m app.gpu.layout` from the dtypes there; do not edit.\n"
    structs = [print_glsl(dtype) for dtype in STRUCTS]
    return "\n".join([header, *structs, _RECORDS_IN_TEXTURES, *map(print_reader, RECORDS)]) + "#endif\n"


if __name__ == "__main__":
    (data_dir("glsl") / STRUCTS_FILE).write_text(structs_glsl())
