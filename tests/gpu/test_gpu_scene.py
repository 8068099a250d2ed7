"""The scene on the GPU: packing, textures, limits, and the shadow map's economy."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import moderngl
import numpy as np
import pytest

from app.bvh.build import Bvh, build_bvh
from app.errors import UserError
from app.gpu.arrays import oriented, pack_lights, pack_materials, pack_vertices
from app.gpu.context import leave_framebuffers
from app.gpu.layout import LIGHT, MATERIAL, VERTEX
from app.gpu.octahedral import octahedral_encode
from app.gpu.programs import Programs
from app.gpu.scene import GpuScene
from app.gpu.shaders import assemble, load_glsl
from app.gpu.shadow import sun_view_projection
from app.gpu.textures import CLASS_SIZES, NO_TEXTURE, Place, SceneTextures, color_layer, size_class, slot_bits
from app.scene.flatten import flatten
from app.scene.geometry import face_cross
from app.scene.model import Image, Light, Material, TextureSlot
from app.tone import srgb_decode

from .live_objects import live_objects
from .small_scenes import checker, moving, quad, scene_of

FLOOR = quad((-1, 0, 1), (2, 0, 0), (0, 0, -2))
SUN = Light("sun", (1.0, 1.0, 1.0), 3.0, direction=(0.0, -1.0, 0.0))


EACH_STORAGE = pytest.mark.parametrize("textures", [False, True], ids=["blocks", "textures"])


def gpu_scene(ctx: moderngl.Context, scene, textures: bool | None = None) -> GpuScene:
    triangles = flatten(scene)

    def load(progress: object) -> Bvh:
        return build_bvh(triangles.positions, triangles.indices)

    return GpuScene(ctx, scene, triangles, load, textures)


def test_vertices_keep_what_they_were() -> None:
    triangles = flatten(scene_of([FLOOR]))
    records = pack_vertices(triangles)
    assert records.dtype == VERTEX
    np.testing.assert_array_equal(np.stack([records[k] for k in ("px", "py", "pz")], -1), triangles.positions)
    np.testing.assert_array_equal(np.stack([records["u"], records["v"]], -1), triangles.uvs)
    halves = records["normal"][:, None].view("<i2") / 32767
    np.testing.assert_allclose(halves, octahedral_encode(triangles.normals), atol=0.5 / 32767)


def test_a_device_that_cannot_place_objects_says_so() -> None:
    class Bare:
        info: ClassVar = {"GL_MAX_SHADER_STORAGE_BLOCK_SIZE": 1 << 24, "GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS": 0}

    scene = moving(scene_of([FLOOR]), 0, slide=[(0, 0, 0), (1, 0, 0)])
    with pytest.raises(UserError, match="nothing moves"):
        GpuScene(Bare(), scene, flatten(scene), None, False)  # type: ignore[arg-type]


def test_winding_follows_the_normals() -> None:
    meshes = [quad((0, 0, 0), (1, 0, 0), (0, 1, 0), flip_winding=flip) for flip in (False, True)]
    turned = oriented(flatten(scene_of(meshes)))
    facing = np.einsum("ij,ij->i", face_cross(turned.positions, turned.indices), turned.normals[turned.indices[:, 0]])
    assert (facing > 0).all()


def test_materials_name_their_textures() -> None:
    slot = TextureSlot(1, "mirror", "clamp", ((2.0, 0.1, 0.3), (0.2, 3.0, 0.4)))
    material = Material((0.1, 0.2, 0.3, 0.4), 0.5, 0.6, (1, 2, 3), 0.7, 0.8, normal_texture=slot)
    (record,) = pack_materials([material], [Place(0, 0), Place(2, 5)])
    assert record.dtype == MATERIAL
    np.testing.assert_allclose(record["base_color"], material.base_color)
    np.testing.assert_allclose(record["emissive"], material.emissive)
    assert [round(float(record[k]), 6) for k in ("metallic", "roughness", "normal_scale", "alpha_cutoff")] == [
        0.5,
        0.6,
        0.7,
        0.8,
    ]
    assert record["textures"].tolist() == [NO_TEXTURE, NO_TEXTURE, 2 << 24 | 2 << 18 | 1 << 16 | 5, NO_TEXTURE]
    np.testing.assert_allclose(record["uv_normal_u"][:3], slot.uv_transform[0])
    np.testing.assert_allclose(record["uv_normal_v"][:3], slot.uv_transform[1])
    np.testing.assert_allclose(record["uv_base_u"][:3], (1, 0, 0))


def test_lights_come_suns_first_and_one_casts() -> None:
    spot = Light("spot", (1, 0.5, 0), 10.0, (1, 2, 3), (0, -1, 0), 4.0, math.radians(20), math.radians(30))
    records = pack_lights([spot, SUN, replace(SUN, intensity=1.0)], np.array([1.0, 1.0, 1.0]))
    np.testing.assert_allclose(records[2]["position"], (0, 1, 2))
    assert records.dtype == LIGHT
    assert records["kind"].tolist() == [0, 0, 2]
    assert records["casts_shadow"].tolist() == [1, 0, 0]
    assert records["inverse_range"].tolist() == [0, 0, 0.25]
    cone = lambda degrees: math.cos(math.radians(degrees)) * records[2]["spot_scale"] + records[2]["spot_offset"]  # noqa: E731
    assert [cone(20), cone(30)] == pytest.approx([1, 0], abs=1e-5)
    np.testing.assert_allclose(records[2]["intensity"], (10, 5, 0))


def test_size_classes_lose_nothing_unless_the_device_demands() -> None:
    image = lambda w, h: Image(np.zeros((h, w, 4), np.uint8), True)  # noqa: E731
    assert [
        size_class(image(w, h), 16384) for w, h in ((1, 1), (256, 4), (257, 4), (4, 1024), (2000, 3), (9000, 9000))
    ] == [0, 0, 1, 1, 2, 2]
    assert size_class(image(2000, 2000), 1024) == 1
    assert slot_bits(None, []) == NO_TEXTURE


def test_colour_is_averaged_in_linear_light() -> None:
    layer = color_layer(checker(2 * CLASS_SIZES[0], 0, 255), CLASS_SIZES[0])
    middle = layer[8:-8, 8:-8, :3].astype(float)
    np.testing.assert_allclose(middle, 0.5, atol=0.01)  # 0.21 if code values were averaged
    np.testing.assert_allclose(srgb_decode(np.array([0, 0.04045, 0.5, 1])), [0, 0.0031308, 0.2140411, 1], atol=1e-6)


@EACH_STORAGE
def test_shaders_see_what_was_packed(ctx, textures: bool) -> None:
    """The GPU echoes fields at the start, middle and end of each struct through glsl/shared/scene.glsl."""
    light = Light("point", (1, 1, 1), 7.0, (4, 5, 6), range=2.0)
    scene = scene_of([FLOOR], [Material(roughness=0.25, emissive=(0, 0, 9), alpha_cutoff=0.5)], lights=[light])
    gpu = gpu_scene(ctx, scene, textures)
    kernel = """#include "shared/scene.glsl"
layout(local_size_x = 1) in;
layout(std430) writeonly buffer Echo { float echo[8]; };
void main() {
    echo = float[](vertex_at(2u).px, vertex_at(2u).v, float(vertex_at(3u).material), material_at(0u).roughness,
                   material_at(0u).emissive.z, material_at(0u).uv_emissive_v.y,
                   light_at(0u).position.z, light_at(0u).inverse_range);
}"""
    program = ctx.compute_shader(assemble("echo", {**load_glsl(), "echo": kernel}, {**gpu.defines, "TEXTURED": 0}).text)
    out = ctx.buffer(reserve=32)
    for binding, (name, block) in enumerate({**gpu.blocks, "Echo": out}.items()):
        program[name].binding = binding
        block.bind_to_storage_buffer(binding)
    for unit, (name, texture) in enumerate(gpu.samplers.items()):
        if name in program:
            program[name] = unit
            texture.use(unit)
    program.run(1)
    ctx.memory_barrier()
    np.testing.assert_allclose(np.frombuffer(out.read(), "f4"), [1, 1, 0, 0.25, 9, 1, 6, 0.5])
    for resource in (program, out, gpu):
        resource.release()


@EACH_STORAGE
def test_records_above_the_devices_limit_are_refused(ctx, textures: bool) -> None:
    scene = scene_of([FLOOR])

    class Small:
        """A device with a block limit of 100 bytes, and no texture rows."""

        def __init__(self) -> None:
            self.info = {**ctx.info, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE": 100, "GL_MAX_TEXTURE_SIZE": 0}

        def __getattr__(self, name: str) -> object:
            return getattr(ctx, name)

    with pytest.raises(UserError, match=r"vertices need .* in one block, but this device allows"):
        GpuScene(Small(), scene, flatten(scene), None, textures)  # type: ignore[arg-type]


def test_more_images_than_layers_are_refused_and_leave_nothing(ctx) -> None:
    class Few:
        """A device with two layers."""

        info: ClassVar = {**ctx.info, "GL_MAX_ARRAY_TEXTURE_LAYERS": 2}

        def __getattr__(self, name: str) -> object:
            return getattr(ctx, name)

    before = live_objects(ctx)
    images = tuple(checker(4, 0, 255) for _ in range(3))
    SceneTextures(Few(), images[:2], True).release()  # type: ignore[arg-type]
    with pytest.raises(UserError, match="3 images of similar size, but the device allows 2"):
        SceneTextures(Few(), images, True)  # type: ignore[arg-type]
    assert live_objects(ctx) == before


def test_rays_get_their_blocks_on_demand(ctx) -> None:
    gpu = gpu_scene(ctx, scene_of([FLOOR]), textures=False)
    assert "BvhNodes" not in gpu.blocks
    assert "BVH_STACK" not in gpu.defines
    gpu.ensure_bvh()
    assert gpu.defines["BVH_STACK"] >= 1
    triangles = np.frombuffer(gpu.blocks["Triangles"].read(), "<u4").reshape(-1, 4)
    assert len(triangles) == gpu.triangle_count == 2
    assert np.frombuffer(gpu.blocks["TrianglePositions"].read(), "<f4").reshape(2, 3, 4).shape == (2, 3, 4)
    blocks = dict(gpu.blocks)
    gpu.ensure_bvh()
    assert blocks == gpu.blocks
    gpu.release()


def test_a_program_that_reuses_a_number_gets_its_own_vertex_array(ctx) -> None:
    """Drivers hand out the number of a released program again: after a reload, or when a split screen closes."""
    gpu = gpu_scene(ctx, scene_of([FLOOR]))
    screen = ctx.simple_framebuffer((4, 4))
    screen.use()
    vertex, fragment = "#version 430\nin {}; void main() {{ gl_Position = {}; }}", "#version 430\nvoid main() {}"
    for attribute, place in (("vec3 position", "vec4(position, 1.0)"), ("vec2 uv", "vec4(uv, 0.0, 1.0)")):
        program = ctx.program(vertex_shader=vertex.format(attribute, place), fragment_shader=fragment)
        gpu.draw(program)
        assert gpu._vertex_arrays[program.glo].program is program
        program.release()
        assert len(gpu._vertex_arrays) == 1, "a released program's goes when the next is made"
    leave_framebuffers(ctx)
    screen.release()
    gpu.release()


def test_the_shadow_map_is_rendered_only_on_change(ctx, programs: Programs) -> None:
    gpu = gpu_scene(ctx, scene_of([FLOOR], lights=[SUN]))
    assert [gpu.update_shadow(programs) for _ in range(3)] == [True, False, False]
    assert gpu.shadow.update(programs, (0.6, -0.8, 0.0))
    assert not gpu.shadow.update(programs, (0.6, -0.8, 0.0))
    assert gpu.shadow.renders == 2
    gpu.release()


def test_without_a_sun_there_is_no_shadow_map_to_pay_for(ctx, programs: Programs) -> None:
    gpu = gpu_scene(ctx, scene_of([FLOOR]))
    assert not gpu.update_shadow(programs)
    assert gpu.shadow.renders == 0
    assert gpu.bytes["shadow map"] <= 4
    gpu.release()


@pytest.mark.parametrize("direction", [(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.3, -0.5, 0.8)])
def test_the_sun_sees_the_whole_box(direction) -> None:
    low, high = (-3.0, 0.0, -1.0), (5.0, 2.0, 40.0)
    unit = tuple(np.asarray(direction) / np.linalg.norm(direction))
    matrix = sun_view_projection(unit, low, high, 2048)
    corners = np.array([[x, y, z, 1] for x in (-3, 5) for y in (0, 2) for z in (-1, 40)], float) @ matrix.T
    assert np.abs(corners[:, :3]).max() <= 1.0
    along = np.array([*unit, 0.0]) @ matrix.T  # moving with the light increases depth and nothing else
    assert along[2] > 0
    assert np.abs(along[:2]).max() < 1e-12
