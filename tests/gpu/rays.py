"""Runs glsl/rays/traverse.glsl on arrays of rays, and says how far float32 may be off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import moderngl
import numpy as np

from app.bvh.build import Bvh, build_bvh
from app.bvh.oracle import intersect_triangle
from app.bvh.pack import from_lowest_corner, pack_triangle_positions, pack_triangles, stack_entries
from app.bvh.top import scene_tree
from app.gpu.records import IN_TEXTURES, Records, RecordTexture, make_records
from app.gpu.scene import GpuScene, Progress
from app.gpu.shaders import assemble, load_glsl
from app.scene.flatten import flatten, places
from app.scene.model import Scene

ULP = 2.0**-24  # largest relative rounding error of one float32 operation
FAR = 1e30
MISS = np.iinfo(np.uint32).max

KERNEL = """#include "rays/traverse.glsl"
layout(local_size_x = 64) in;
layout(std430) readonly buffer Rays { vec4 rays[]; };
layout(std430) writeonly buffer Results { uvec4 results[]; };
uniform uint count;
uniform float t_min, t_max;
ALPHA
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Hit hit = Hit(0.0, 0.0, 0u, uvec3(0u), 0u, 0u, vec2(0.0));
    Ray ray = Ray(rays[2u * i].xyz, rays[2u * i + 1u].xyz, t_min);
    bool found = TRACE;
    results[i] = uvec4(floatBitsToUint(hit.t), found ? hit.triangle : 0xffffffffu, floatBitsToUint(hit.barycentrics));
}"""


@dataclass(frozen=True)
class Result:
    """What the shader answered. `place` is the triangle's place in leaf order, `triangle` its index in the mesh."""

    hit: np.ndarray  # (r,) bool
    t: np.ndarray  # (r,) float64
    place: np.ndarray  # (r,)
    triangle: np.ndarray  # (r,)
    barycentrics: np.ndarray  # (r, 2)


class Mesh:
    """Triangles (m, 3, 3) with their tree on the GPU, in storage blocks or in textures."""

    def __init__(
        self, ctx: moderngl.Context, positions: np.ndarray, indices: np.ndarray, materials: np.ndarray | None = None,
        textures: bool = False, drawn: np.ndarray | None = None,
    ):  # fmt: skip
        self.ctx = ctx
        positions = np.ascontiguousarray(positions, np.float32)
        indices = from_lowest_corner(positions, np.ascontiguousarray(indices, np.uint32))
        drawn = np.arange(len(indices)) if drawn is None else drawn
        materials = np.zeros(len(positions), np.uint32) if materials is None else materials
        self.corners = positions[indices].astype(np.float64)
        self.bvh: Bvh = build_bvh(positions, indices)
        order = self.bvh.order
        self.textures = textures
        self.records = {
            name: make_records(ctx, data.tobytes() or bytes(16), textures)
            for name, data in {
                "BvhNodes": self.bvh.nodes,
                "Triangles": pack_triangles(order, indices, materials),
                "TrianglePositions": pack_triangle_positions(order, positions, indices, drawn),
            }.items()
        }

    @staticmethod
    def of(
        ctx: moderngl.Context, corners: np.ndarray, materials: np.ndarray | None = None,
        drawn: np.ndarray | None = None,
    ) -> Mesh:  # fmt: skip
        """A mesh from loose corners (m, 3, 3); each triangle with a material and a place in the order of drawing."""
        indices = np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3)
        materials = None if materials is None else np.repeat(materials, 3)
        return Mesh(ctx, corners.reshape(-1, 3), indices, materials, drawn=drawn)

    def trace(
        self, origins: np.ndarray, directions: np.ndarray, t_min: float = 0.0, t_max: float = FAR,
        call: str = "trace_closest(ray, t_max, hit)", alpha: str = "",
    ) -> Result:  # fmt: skip
        """Runs `call` for every ray."""
        defines = {"BVH_STACK": stack_entries(self.bvh.depth), "OBJECTS": 0, **({"HAS_ALPHA_MASK": 1} if alpha else {})}
        defines |= {IN_TEXTURES: 1} if self.textures else {}
        return trace_rays(
            self.ctx, self.records, self.bvh.order, defines, (origins, directions), (t_min, t_max), call, alpha
        )

    def release(self) -> None:
        for records in self.records.values():
            records.release()


class MovingMesh:
    """A scene with moving objects on the GPU, at one time after another."""

    def __init__(self, ctx: moderngl.Context, scene: Scene) -> None:
        self.ctx, self.triangles = ctx, flatten(scene)
        self.order = np.zeros(0, np.uint32)
        self.gpu = GpuScene(ctx, scene, self.triangles, self._tree, textures=False)
        self.gpu.ensure_bvh()

    def _tree(self, progress: Progress | None) -> Bvh:
        tree = scene_tree(self.triangles, build_bvh, progress)
        self.order = tree.order
        return tree

    def corners(self, time_s: float) -> np.ndarray:
        """(m, 3, 3) of all triangles in the world, float64."""
        t = self.triangles
        still = np.eye(4)[None]
        still[0, :3, 3] = t.origin
        there = np.concatenate([still, places(t.moving, time_s)])[t.objects]
        world = np.einsum("nij,nj->ni", there[:, :3, :3], t.positions.astype(float)) + there[:, :3, 3]
        return world[t.indices]

    def trace(
        self, time_s: float, origins: np.ndarray, directions: np.ndarray,
        call: str = "trace_closest(ray, t_max, hit)", t_min: float = 0.0, t_max: float = FAR,
    ) -> Result:  # fmt: skip
        """Runs `call` for every ray, with the scene as it is at a time; `triangle` is its index in `corners`."""
        self.gpu.place(time_s, time_s)
        defines = {"OBJECTS": 1, **{k: v for k, v in self.gpu.defines.items() if k.endswith("_STACK")}}
        rays, limits = (origins - self.triangles.origin, directions), (t_min, t_max)
        return trace_rays(self.ctx, self.gpu.blocks, self.order, defines, rays, limits, call, "")

    def release(self) -> None:
        self.gpu.release()


def trace_rays(
    ctx: moderngl.Context, scene: Mapping[str, Records], order: np.ndarray, defines: Mapping[str, object],
    rays_od: tuple[np.ndarray, np.ndarray], limits: tuple[float, float], call: str, alpha: str,
) -> Result:  # fmt: skip
    """Runs `call` for every ray (origins, directions) between t_min and t_max on the records of a scene."""
    origins, directions = rays_od
    kernel = KERNEL.replace("TRACE", call).replace("ALPHA", alpha)
    shader = ctx.compute_shader(assemble("<test>", {**load_glsl(), "<test>": kernel}, defines).text)
    rays = np.zeros((len(origins), 2, 4), np.float32)
    rays[:, 0, :3], rays[:, 1, :3] = origins, directions
    held_in_textures = {name: held.texture for name, held in scene.items() if isinstance(held, RecordTexture)}
    for unit, (name, texture) in enumerate(held_in_textures.items()):
        if name in shader:
            texture.use(unit)
            shader[name] = unit
    buffers = {
        **{name: held for name, held in scene.items() if name not in held_in_textures},
        "Rays": ctx.buffer(rays.tobytes()),
        "Results": ctx.buffer(reserve=16 * len(rays)),
    }
    blocks = [name for name in shader if isinstance(shader[name], moderngl.StorageBlock)]
    for binding, name in enumerate(blocks):
        shader[name].binding = binding
        buffers[name].bind_to_storage_buffer(binding)
    for name, value in {"count": len(rays), "t_min": limits[0], "t_max": limits[1]}.items():
        if name in shader:
            shader[name] = value
    shader.run(-(-len(rays) // 64))
    ctx.memory_barrier()
    raw = np.frombuffer(buffers["Results"].read(), np.uint32).reshape(-1, 4)
    for resource in (shader, buffers["Rays"], buffers["Results"]):
        resource.release()
    hit, place, values = raw[:, 1] != MISS, raw[:, 1], raw.view(np.float32).astype(float)
    triangle = np.full(len(raw), -1)
    triangle[hit] = order[place[hit]]
    return Result(hit, values[:, 0], place, triangle, values[:, 2:])


def rounding(
    origins: np.ndarray, directions: np.ndarray, corners: np.ndarray, shift: float | np.ndarray = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """What float32 may be off for rays (r, 3) and their triangles (r, 3, 3): (error of t, error of the weights).

    Two sources. Each vertex is translated to the origin and sheared: four roundings of numbers below `reach`, two terms
    each, move it by `shift`. This moves planes by shift / |cos| along the ray, and each edge function by shift * size.
    Each edge function then rounds products below size^2 three times; relative to the projected area that is an error of
    the weights, and times the triangle's depth an error of t. A ray may also pass beside by the shift itself. `shift`
    is what else may move the triangle against the ray.
    """
    length = np.linalg.norm(directions, axis=1)
    unit = directions / length[:, None]
    relative = corners - origins[:, None]
    reach = np.abs(relative).max(axis=(1, 2))
    edges = corners[:, [1, 2, 0]] - corners
    size = np.linalg.norm(edges, axis=2).max(axis=1)
    projected = np.abs(np.einsum("ri,ri->r", np.cross(edges[:, 0], edges[:, 1]), unit))
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    shift = shift + 2 * 4 * ULP * reach
    spread = size + shift
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = 2 * (shift * spread + 3 * ULP * spread**2) / projected
        t = (shift * area / projected + weights * size) / length + 8 * ULP * reach / length
    return t, weights


def exact(origins: np.ndarray, directions: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(t, smallest weight) in float64 of the rays as the shader saw them: rounded to float32."""
    o, d = (np.asarray(a, np.float32).astype(float) for a in (origins, directions))
    t, v, w = intersect_triangle(o, d, corners)
    with np.errstate(invalid="ignore"):  # infinite weights: parallel to the plane
        return t, np.minimum(np.minimum(v, w), 1 - v - w)
