"""Dear ImGui drawn with moderngl: vertex streams, scissors, and the textures that ImGui 1.92 asks for."""

from __future__ import annotations

import ctypes
from typing import Any

import moderngl
import numpy as np
from imgui_bundle import imgui

from .programs import Programs

INITIAL_ELEMENTS = 1 << 15  # vertices and indices reserved at first; grown on demand


class ImguiRenderer:
    """Draws what `imgui.render()` produced. One per ImGui context; release it before either context goes."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._textures: dict[int, moderngl.Texture] = {}
        imgui.get_io().backend_flags |= (
            imgui.BackendFlags_.renderer_has_textures
        )  # no vertex offsets: indices have 32 bits
        self._program = Programs(ctx).get("output/ui", ()).program
        self._vertices = ctx.buffer(reserve=INITIAL_ELEMENTS * imgui.VERTEX_SIZE, dynamic=True)
        self._indices = ctx.buffer(reserve=INITIAL_ELEMENTS * imgui.INDEX_SIZE, dynamic=True)
        layout = [(self._vertices, "2f 2f 4f1", "position", "uv", "color")]
        self._array = ctx.vertex_array(
            self._program, layout, index_buffer=self._indices, index_element_size=imgui.INDEX_SIZE
        )

    def render(self, data: Any) -> None:
        """Draw an `imgui.ImDrawData` over all of the bound framebuffer: display_size times framebuffer_scale px."""
        for texture in data.textures or ():
            if texture.status != imgui.ImTextureStatus.ok:
                self._serve(texture)
        size, scale, origin = data.display_size, data.framebuffer_scale, data.display_pos
        height = int(size.y * scale.y)
        if size.x <= 0 or size.y <= 0:
            return
        self._ctx.enable_only(moderngl.BLEND)
        self._ctx.blend_func = (  # type: ignore[assignment]  # moderngl's stub knows only the two-value form
            moderngl.SRC_ALPHA,
            moderngl.ONE_MINUS_SRC_ALPHA,
            moderngl.ONE,
            moderngl.ONE_MINUS_SRC_ALPHA,
        )
        self._program["transform"] = (2 / size.x, -2 / size.y, -1 - 2 * origin.x / size.x, 1 + 2 * origin.y / size.y)
        for commands in data.cmd_lists:
            self._upload(commands)
            for command in commands.cmd_buffer:
                x0, y0 = (command.clip_rect.x - origin.x) * scale.x, (command.clip_rect.y - origin.y) * scale.y
                x1, y1 = (command.clip_rect.z - origin.x) * scale.x, (command.clip_rect.w - origin.y) * scale.y
                if x1 <= x0 or y1 <= y0:
                    continue
                self._ctx.scissor = (int(x0), int(height - y1), int(x1 - x0), int(y1 - y0))
                self._textures[command.tex_ref.get_tex_id()].use(0)
                self._array.render(moderngl.TRIANGLES, vertices=command.elem_count, first=command.idx_offset)
        self._ctx.scissor = None
        self._ctx.disable(moderngl.BLEND)

    def release(self) -> None:
        """Give back every GL object, and tell ImGui that its textures are gone."""
        for texture in imgui.get_platform_io().textures:
            texture.set_tex_id(0)
            texture.set_status(imgui.ImTextureStatus.destroyed)
        resources: tuple[Any, ...] = (
            *self._textures.values(),
            self._array,
            self._vertices,
            self._indices,
            self._program,
        )
        for resource in resources:
            resource.release()
        self._textures.clear()

    def _serve(self, request: Any) -> None:
        status = imgui.ImTextureStatus
        if request.status == status.want_create:
            texture = self._ctx.texture((request.width, request.height), 4, _pixels(request).tobytes())
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            texture.repeat_x = texture.repeat_y = False
            self._textures[texture.glo] = texture
            request.set_tex_id(texture.glo)
            request.set_status(status.ok)
        elif request.status == status.want_updates:
            pixels = _pixels(request)
            for r in request.updates:
                part = np.ascontiguousarray(pixels[r.y : r.y + r.h, r.x : r.x + r.w])
                self._textures[request.tex_id].write(part.tobytes(), viewport=(r.x, r.y, r.w, r.h))
            request.set_status(status.ok)
        elif request.status == status.want_destroy and request.unused_frames > 0:
            self._textures.pop(request.tex_id).release()
            request.set_tex_id(0)
            request.set_status(status.destroyed)

    def _upload(self, commands: Any) -> None:
        for buffer, source, item in (
            (self._vertices, commands.vtx_buffer, imgui.VERTEX_SIZE),
            (self._indices, commands.idx_buffer, imgui.INDEX_SIZE),
        ):
            count = source.size() * item
            buffer.orphan(
                max(buffer.size, 2 * count if count > buffer.size else 0)
            )  # the GPU may still read the last list
            if count:
                buffer.write((ctypes.c_byte * count).from_address(source.data_address()))


def _pixels(request: Any) -> np.ndarray:
    """(height, width, 4) of a texture that ImGui fills."""
    return np.ascontiguousarray(request.get_pixels_array()).reshape(
        request.height, request.width, request.bytes_per_pixel
    )
