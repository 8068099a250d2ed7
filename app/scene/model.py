"""The scene as plain arrays: what loading produces and everything later reads.

Conventions: right-handed, y up, metres, linear colour, row-major 4x4 matrices that act on column vectors.
Nothing here knows a file format or the GPU.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .motion import Motion

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U32 = NDArray[np.uint32]


@dataclass(frozen=True)
class Mesh:
    """Indexed triangles in their own space; one material throughout."""

    positions: F32  # (n, 3) m
    normals: F32  # (n, 3) unit
    uvs: F32  # (n, 2); v grows downwards in the image, as in glTF
    tangents: F32  # (n, 4) unit xyz, handedness +-1 in w; zero where the mesh has no usable uvs
    triangles: U32  # (m, 3) indices into the vertices
    material: int  # index into Scene.materials
    name: str = ""


LARGEST_IMAGE_PX = 2048  # per side; larger ones are drawn at this size: 44 MiB a colour image with its levels


@dataclass(frozen=True)
class Image:
    """8-bit RGBA pixels, top row first."""

    pixels: NDArray[np.uint8]  # (h, w, 4)
    srgb: bool  # True for base colour and emissive, False for data (normals, metallic-roughness)
    name: str = ""


Wrap = Literal["repeat", "mirror", "clamp"]


@dataclass(frozen=True)
class TextureSlot:
    """Where a material reads an image: sampler and KHR_texture_transform, folded into a 2x3 matrix on uv."""

    image: int  # index into Scene.images
    wrap_u: Wrap = "repeat"
    wrap_v: Wrap = "repeat"
    uv_transform: tuple[tuple[float, float, float], tuple[float, float, float]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True)
class Material:
    """glTF 2.0 metallic-roughness; colours linear."""

    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    metallic: float = 0.0
    roughness: float = 1.0
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)  # already times KHR_materials_emissive_strength
    normal_scale: float = 1.0
    alpha_cutoff: float | None = None  # None: opaque; else texels below it are holes (alphaMode MASK)
    base_color_texture: TextureSlot | None = None
    metallic_roughness_texture: TextureSlot | None = None
    normal_texture: TextureSlot | None = None
    emissive_texture: TextureSlot | None = None
    name: str = ""


@dataclass(frozen=True)
class Instance:
    """A mesh placed in the world (a leaf of the flattened scene graph)."""

    mesh: int
    transform: F64  # (4, 4) mesh to world, at time 0
    name: str = ""
    motion: Motion | None = None  # displaces it from there as time goes by; shared by all that moves as one


@dataclass(frozen=True)
class Light:
    """KHR_lights_punctual after world transform."""

    kind: Literal["sun", "point", "spot"]
    color: tuple[float, float, float]  # linear; times intensity: lux (sun) or candela (point, spot)
    intensity: float
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m, world
    direction: tuple[float, float, float] = (0.0, -1.0, 0.0)  # unit, world, the way the light travels
    range: float = float("inf")  # m
    inner_cone: float = 0.0  # rad, spot only
    outer_cone: float = float(np.pi / 4)  # rad, spot only


@dataclass(frozen=True)
class Environment:
    """A two-colour hemisphere (linear radiance): what the sky pixels show and what fills the shadows."""

    sky: tuple[float, float, float] = (0.5, 0.6, 0.7)
    ground: tuple[float, float, float] = (0.25, 0.23, 0.21)


@dataclass(frozen=True)
class SceneCamera:
    """A viewpoint that the scene file itself carries; same fields as a camera file (DESIGN section 7)."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    fov_y_deg: float
    focus_distance: float | None = None  # m
    aperture: float | None = None  # m
    name: str = ""


@dataclass(frozen=True)
class LoadReport:
    """What loading saw, changed and dropped, in sentences a user can act on."""

    source: str
    triangles: int
    vertices: int
    degenerate: int  # zero-area or repeated-index triangles, dropped
    notes: tuple[str, ...] = ()  # one sentence per dropped or changed feature
    seconds: float = 0.0


@dataclass(frozen=True)
class Scene:
    """Everything that can be drawn. World-space triangles come from `flatten`."""

    meshes: tuple[Mesh, ...]
    materials: tuple[Material, ...]
    instances: tuple[Instance, ...]
    images: tuple[Image, ...] = ()
    lights: tuple[Light, ...] = ()
    environment: Environment = field(default_factory=Environment)
    cameras: tuple[SceneCamera, ...] = ()
    report: LoadReport = LoadReport("", 0, 0, 0)


@dataclass(frozen=True)
class MovingObject:
    """Instances that move as one. Its own space: the world's axes at time 0, around the middle of its box, so that
    float32 is at its best there.
    """

    motion: Motion
    origin: F64  # (3,) of its space, m, world at time 0
    half_size: F64  # (3,) of its box around the origin, m
    low: F64  # (3,) lowest corner of a box around all that it passes through, m, world
    high: F64


@dataclass(frozen=True)
class Triangles:
    """All instances baked into one vertex list and one triangle list: what stands still, first, then each moving object
    in its own space.

    What stands still keeps the world's axes, about an `origin` near it: float32 has no digits to spend on how far the
    scene lies from the world's origin.

    `materials` and `objects` are per vertex, so that one draw call and one lookup at a ray hit serve them all.
    """

    positions: F32  # (n, 3) m, from the origin
    normals: F32  # (n, 3) unit, world
    uvs: F32  # (n, 2)
    tangents: F32  # (n, 4)
    materials: U32  # (n,)
    indices: U32  # (m, 3), ascending by object
    objects: U32  # (n,) 0: stands still; k: moves with moving[k - 1]
    moving: tuple[MovingObject, ...] = ()
    origin: F64 = field(default_factory=lambda: np.zeros(3))  # (3,) of positions, m, world
