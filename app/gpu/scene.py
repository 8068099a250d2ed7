"""The scene on the GPU: every buffer and texture that outlives a frame, packed once and owned here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..bvh.background import Background
from ..bvh.build import Bvh
from ..bvh.pack import pack_triangle_positions, pack_triangles, stack_entries
from ..errors import UserError
from ..scene.facts import SceneFacts, facts_of, near_plane
from ..scene.model import Environment, Light, Scene, Triangles
from .arrays import draw_order, material_words, oriented, pack_lights, pack_materials, pack_vertices
from .objects import GpuObjects
from .programs import Programs
from .records import IN_TEXTURES, Records, RecordTexture, check_fits, in_textures, make_records
from .shadow import ShadowMap
from .textures import SceneTextures

Progress = Callable[[str, float], None]

_WORDS = {
    "Vertices": "vertices",
    "Materials": "materials",
    "Lights": "lights",
    "Triangles": "triangles",
    "TrianglePositions": "triangle positions",
    "BvhNodes": "ray-tracing tree",
}
ATTRIBUTES = (("position", "3f", 12), ("normal", "1u", 4), ("uv", "2f", 8), ("tangent", "1u", 4), ("material", "1u", 4))


@dataclass(frozen=True)
class _Tree:
    """What rays read, packed for the GPU: arrays by the name that shaders use."""

    records: dict[str, NDArray[Any]]
    stack: int  # entries that a walk down the tree may have to remember
    roots: tuple[int, ...]


class GpuScene:
    """Records and textures by the names that shaders use, and the facts that planning needs.

    Raises UserError where the scene exceeds a limit of the device. `bvh_loader(progress)` builds or loads the tree
    (app/bvh/top.py: scene_tree) when rays first need it. Records lie where the device reads them faster, unless
    `textures` says where (app/gpu/records.py).
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        scene: Scene,
        triangles: Triangles,
        bvh_loader: Callable[[Progress | None], Bvh] | None = None,
        textures: bool | None = None,
    ) -> None:
        self._ctx, self._bvh_loader = ctx, bvh_loader
        if triangles.moving and not ctx.info.get("GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS"):  # OpenGL 4.3 grants none
            raise UserError("this device cannot place moving objects: choose a scene in which nothing moves")
        self._triangles = triangles = oriented(triangles)
        self.facts: SceneFacts = facts_of(scene, triangles)
        self.near_plane = near_plane(self.facts.low, self.facts.high)
        self.triangle_count = len(triangles.indices)
        self.textures = SceneTextures(ctx, scene.images, self.facts.textured)
        self._in_textures = in_textures(ctx) if textures is None else textures
        self._records: dict[str, Records] = {}
        self._tree_build: Background[_Tree] | None = None
        self._no_tree: UserError | None = None  # why there will never be one
        vertices = pack_vertices(triangles)
        try:
            self._upload(
                Vertices=vertices,
                Materials=pack_materials(scene.materials, self.textures.places),
                Lights=pack_lights(scene.lights, triangles.origin),
            )
        except UserError:
            self.textures.release()
            raise
        self.objects = GpuObjects(ctx, triangles, self._in_textures) if triangles.moving else None
        if self.objects:
            self._records["Objects"] = self.objects.records
        block = self._records["Vertices"]
        self._vertices = ctx.buffer(_or_one(vertices)) if isinstance(block, RecordTexture) else block
        masked = np.array([m.alpha_cutoff is not None for m in scene.materials])
        self._drawn = draw_order(triangles, masked)
        self._indices = ctx.buffer(_or_one(triangles.indices[self._drawn]))
        self._vertex_arrays: dict[int, moderngl.VertexArray] = {}
        self._bvh_defines: dict[str, int] = {}
        self.origin = triangles.origin  # (3,) m, world: all that shaders see is relative to it
        self.shadow = ShadowMap(ctx, self, *(np.subtract(c, self.origin) for c in (self.facts.low, self.facts.high)))
        self.environment: Environment = scene.environment
        self.sun: Light | None = next((light for light in scene.lights if light.kind == "sun"), None)

    @property
    def samplers(self) -> dict[str, Any]:
        """Textures by the name that shaders use."""
        records = {name: held.texture for name, held in self._records.items() if isinstance(held, RecordTexture)}
        return {**self.textures.samplers, "scene_shadow": self.shadow.texture, **records}

    @property
    def blocks(self) -> dict[str, moderngl.Buffer]:
        """Storage blocks by the name that shaders use."""
        return {name: held for name, held in self._records.items() if not isinstance(held, RecordTexture)}

    @property
    def defines(self) -> dict[str, int]:
        """What every shader that touches the scene must be compiled with."""
        where = {IN_TEXTURES: 1} if self._in_textures else {}
        return {**self.textures.defines, **self._bvh_defines, **where}

    @property
    def bytes(self) -> dict[str, int]:
        """GPU bytes by resource."""
        records = {name: held.size for name, held in self._records.items()}
        drawn = {"indices": self._indices.size} | ({"vertex buffer": self._vertices.size} if self._in_textures else {})
        return {**records, **drawn, "textures": self.textures.bytes, "shadow map": self.shadow.bytes}

    @property
    def has_tree(self) -> bool:
        """Whether rays can be traced."""
        return "BvhNodes" in self._records

    @property
    def tree_progress(self) -> tuple[str, float] | None:
        """What the thread that makes the tree is doing, and which part is done; None where none does."""
        return self._tree_build.progress if self._tree_build else None

    def ensure_bvh(self, progress: Progress | None = None) -> None:
        """Make the records that rays read exist (glsl/rays/traverse.glsl); the first call builds or loads the tree."""
        if self._tree_build:
            self._tree_build.wait(progress)
        elif not (self.has_tree or self._no_tree):
            self._take_tree(self._made_tree(progress))
        self.request_tree()

    def request_tree(self) -> bool:
        """The same without waiting: the first call lets a thread begin. True once rays can be traced; raises UserError
        if they never can.
        """
        if self._no_tree:
            raise self._no_tree
        if self.has_tree:
            return True
        if self._tree_build is None:
            self._tree_build = Background("Preparing rays", self._made_tree)
        return self._tree_build.done and self._finish_tree(self._tree_build)

    def _finish_tree(self, build: Background[_Tree]) -> bool:
        """Take what the thread made; raises UserError, now and whenever it is asked for again, if it made none."""
        self._tree_build = None
        try:
            self._take_tree(build.result())
        except UserError as error:
            self._no_tree = error
            raise
        except Exception as error:  # of a thread, which cannot end the program
            self._no_tree = UserError(f"no rays here, since their tree could not be built ({error})")
            raise self._no_tree from error
        return True

    def _made_tree(self, progress: Progress | None) -> _Tree:
        """Everything about the tree that needs no OpenGL: may run in a thread."""
        if self._bvh_loader is None:
            raise UserError("this scene was opened without a tree for rays; open it with one to trace")
        bvh, t = self._bvh_loader(progress), self._triangles
        records = {
            "Triangles": pack_triangles(bvh.order, t.indices, material_words(t)),
            "TrianglePositions": pack_triangle_positions(bvh.order, t.positions, t.indices, np.argsort(self._drawn)),
            "BvhNodes": bvh.nodes,
        }
        return _Tree(records, stack_entries(bvh.depth), bvh.roots)

    def _take_tree(self, tree: _Tree) -> None:
        """Put it on the GPU."""
        self._upload(**tree.records)
        self._bvh_defines = {"BVH_STACK": tree.stack}
        if self.objects:
            self._bvh_defines["TOP_STACK"] = self.objects.stack
            self.objects.take_roots(tree.roots)
            self._records["BvhNodes"].write(self.objects.top_nodes().tobytes())

    def place(self, time_s: float, previous_s: float) -> None:
        """Move the objects, if any, to where they are at `time_s` and were last frame at `previous_s`."""
        if self.objects and self.objects.place(time_s, previous_s) and self.has_tree:
            self._records["BvhNodes"].write(self.objects.top_nodes().tobytes())

    def update_shadow(self, programs: Programs) -> bool:
        """Render the shadow map if the sun, the geometry or its shader changed since; True if it was rendered."""
        time_s = self.objects.time_s if self.objects else 0.0
        return self.sun is not None and self.shadow.update(programs, self.sun.direction, time_s)

    def draw(self, program: moderngl.Program, vertices: int = -1) -> None:
        """Draw every triangle with one call, or so many vertices; the program names the attributes it wants."""
        if not self.triangle_count:
            return
        array = self._vertex_arrays.get(program.glo)
        if array is None or array.program is not program:  # drivers give a released program's number to the next one
            self._forget_released_programs()
            array = self._vertex_arrays[program.glo] = self._vertex_array(program)
        array.render(vertices=vertices)

    def release(self) -> None:
        """Free everything this scene holds on the GPU, and leave its tree if that is still being built."""
        if self._tree_build:
            self._tree_build.leave()
        for vertex_array in self._vertex_arrays.values():
            vertex_array.release()
        for buffer in {*self._records.values(), self._vertices, self._indices}:
            buffer.release()
        self.textures.release()
        self.shadow.release()
        self._vertex_arrays.clear()
        self._records.clear()

    def _forget_released_programs(self) -> None:
        for number, array in list(self._vertex_arrays.items()):
            if isinstance(array.program.mglo, moderngl.InvalidObject):
                array.release()
                del self._vertex_arrays[number]

    def _vertex_array(self, program: moderngl.Program) -> moderngl.VertexArray:
        wanted = [(name, kind if name in program else f"{size}x", name in program) for name, kind, size in ATTRIBUTES]
        layout = " ".join(kind for _, kind, _ in wanted)
        names = [name for name, _, used in wanted if used]
        vertices = [(self._vertices, layout, *names)] if names else []  # a shader that is being edited may want nothing
        return self._ctx.vertex_array(program, vertices, self._indices)

    def _upload(self, **arrays: NDArray[Any]) -> None:
        """Put arrays of records on the GPU, or none of them if one is too large."""
        for name, records in arrays.items():
            check_fits(self._ctx, _WORDS[name], records.nbytes, self._in_textures)
        for name, records in arrays.items():
            self._records[name] = make_records(self._ctx, _or_one(records), self._in_textures)


def _or_one(records: NDArray[Any]) -> bytes:
    """The bytes of some records, or of one that is all zeros if there is none: a buffer must have a size. Of vertices
    and indices, that is a triangle without area.
    """
    return records.tobytes() or bytes(records.dtype.itemsize * math.prod(records.shape[1:]))
