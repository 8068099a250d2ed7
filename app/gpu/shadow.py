"""The sun's shadow map: depth along the light, rendered again only when the light has turned or an object moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..scene.facts import SceneFacts
from .context import leave_framebuffers
from .programs import Program, Programs, give

Vec3 = tuple[float, float, float]

SIZE = 2048  # texels per side: 5 mm in a 10 m room; 16 MiB, which every OpenGL 4.3 device has to spare
MARGIN_TEXELS = 2.0  # around the scene, so that filter taps at its rim read texels that were rendered
BYTES_PER_TEXEL = 4


class Drawable(Protocol):
    """What the map needs of a scene."""

    @property
    def samplers(self) -> Mapping[str, Any]: ...

    @property
    def defines(self) -> Mapping[str, int]: ...

    @property
    def blocks(self) -> Mapping[str, moderngl.Buffer]: ...

    @property
    def facts(self) -> SceneFacts: ...

    def draw(self, program: moderngl.Program) -> None: ...


class ShadowMap:
    """Owns the depth texture. `renders` counts how often it was drawn."""

    def __init__(self, ctx: moderngl.Context, scene: Drawable, low: ArrayLike, high: ArrayLike) -> None:
        self._ctx, self._scene, self._low, self._high = ctx, scene, low, high
        self._shown: object = None
        self._defines = _defines(scene)  # once: those of the ray-tracing tree come later and do not matter here
        self.size = SIZE if scene.facts.sun else 1  # without a sun nothing reads it, but a sampler must have a texture
        self.texture = ctx.depth_texture((self.size, self.size))
        self.texture.compare_func = "<="
        self.texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.texture.repeat_x = self.texture.repeat_y = False
        self._framebuffer = ctx.framebuffer(depth_attachment=self.texture)
        self.view_proj: NDArray[np.float64] = np.eye(4)
        self.renders = 0

    @property
    def bytes(self) -> int:
        """Of the depth texture."""
        return self.size * self.size * BYTES_PER_TEXEL

    def update(self, programs: Programs, direction: Vec3, time_s: float = 0.0) -> bool:
        """Render for light travelling along `direction` (unit), and the scene as it was placed for `time_s`, unless the
        map shows just that. True if it rendered.
        """
        compiled = programs.get("raster/shadow", self._defines.items())
        wanted = direction, time_s, compiled.texts
        if self._shown == wanted:
            return False
        self._shown = wanted
        self.view_proj = sun_view_projection(direction, self._low, self._high, self.size)
        self._render(compiled.program)
        self.renders += 1
        return True

    def release(self) -> None:
        """Free the texture."""
        self._framebuffer.release()
        self.texture.release()

    def _render(self, program: Program) -> None:
        give(program, sun_view_proj=tuple(self.view_proj.T.ravel()))
        for unit, (name, texture) in enumerate(self._scene.samplers.items()):
            if name in program:
                texture.use(unit)
                program[name] = unit
        for unit, (name, buffer) in enumerate(self._scene.blocks.items()):
            if name in program:
                program[name].binding = unit
                buffer.bind_to_storage_buffer(unit)
        self._framebuffer.use()
        self._framebuffer.clear(depth=1.0)
        self._ctx.enable_only(moderngl.DEPTH_TEST)
        self._scene.draw(program)
        leave_framebuffers(self._ctx)


def _defines(scene: Drawable) -> dict[str, int]:
    facts = scene.facts
    holes = {"ALPHA_MASKED": int(facts.alpha_masked), "TEXTURED": int(facts.textured and facts.alpha_masked)}
    unused = {"LIT": 0, "NORMAL_MAPPED": 0, "EMISSIVE": 0}
    return {**scene.defines, **holes, **unused, "OBJECTS": int(facts.objects)}


def sun_view_projection(direction: Vec3, low: ArrayLike, high: ArrayLike, size: int) -> NDArray[np.float64]:
    """World to the clip space (4, 4) of light along `direction`: orthographic, around the box `low`..`high` [m]."""
    z = -np.asarray(direction, np.float64) / np.linalg.norm(direction)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]  # the axis least along the light: never parallel to it
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    corners = np.stack(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij"), -1).reshape(-1, 3) @ rotation.T
    centre, half = (corners.max(0) + corners.min(0)) / 2.0, (corners.max(0) - corners.min(0)) / 2.0
    side = max(half[0], half[1], 1e-6) * (1.0 + 2.0 * MARGIN_TEXELS / size)
    half_depth = max(half[2], 1e-6) * 1.01  # 1 %: rounding must not clip the outermost caster
    scale = 1.0 / np.array([side, side, -half_depth])  # -z is away from the light
    matrix = np.eye(4)
    matrix[:3, :3] = scale[:, None] * rotation
    matrix[:3, 3] = -scale * centre
    return matrix
