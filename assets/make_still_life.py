"""Makes still_life.glb, the default scene: `python assets/make_still_life.py [OUT.glb]`. Same input, same bytes.

A table set with a patterned vase, fruit and chess pieces is in focus. Between it and the lens hang a leafy branch and a
woven wire screen, so that the lens sees behind what the pinhole sees: partial occlusion at first sight. Behind it,
small bright bulbs before patterned wallpaper turn into discs. Lengths in metres, colours of factors linear.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import shapes
import textures
from glb import GlbWriter
from occluders import build_branch, build_screen
from profiles import pawn_profile, queen_profile, vase_profile
from staging import add_camera, finished, look_at, material, place, tiled

EYE, TARGET = np.array([0.16, 1.04, 1.15]), np.array([0.025, 0.89, 0.0])
FOV_Y = np.radians(32.0)
TABLE = 0.75  # height of the table top
VASE = np.array([-0.07, TABLE, 0.02])
FOCUS_POINT = VASE + np.array([0.02, 0.13, 0.083])  # the painted belly of the vase, on the side that faces the lens
APERTURE = 0.03  # strong, yet the leaves nearest to the lens blur over less than a tenth of the image height
REPEAT, CLAMP = 0, 1  # samplers


def build_room(writer: GlbWriter, planks: int) -> None:
    """Floor, two papered walls, and a sideboard against the back wall."""
    paper = writer.texture("wallpaper", textures.wallpaper(512), REPEAT)
    wall = material(writer, "wallpaper", (1, 1, 1), 0.0, 0.9, texture=tiled(paper, 2.0))
    floor = material(writer, "floor", (0.75, 0.7, 0.65), 0.0, 0.45, texture=tiled(planks, 1.2))
    cabinet = material(writer, "sideboard", (0.55, 0.45, 0.42), 0.0, 0.5, texture={"index": planks})
    x, y, z = np.eye(3)
    ground = shapes.quad(np.array([-2.6, 0.0, -3.2]), 5.2 * x, 5.7 * z, (5.2, 5.7), 8)
    back = shapes.quad(np.array([-2.6, 2.8, -3.2]), 5.2 * x, -2.8 * y, (5.2, 2.8), 8)
    left = shapes.quad(np.array([-2.6, 2.8, 2.5]), -5.7 * z, -2.8 * y, (5.7, 2.8), 8)
    for name, shape, surface in (("floor", ground, floor), ("back wall", back, wall), ("left wall", left, wall)):
        writer.node(name, mesh=writer.mesh(name, shape, surface))
    body = shapes.box(np.array([-1.9, 0.08, -3.15]), np.array([0.1, 0.72, -2.7]), 1.0)
    writer.node("sideboard", mesh=writer.mesh("sideboard", body, cabinet))


def build_table(writer: GlbWriter, planks: int) -> None:
    """The table with a chessboard lying on it."""
    wood = material(writer, "table", (1, 1, 1), 0.0, 0.35, texture=tiled(planks, 0.9))
    board = writer.texture("chessboard", textures.checkerboard(256), CLAMP)
    squares = material(writer, "chessboard", (1, 1, 1), 0.0, 0.25, texture={"index": board})
    rim = material(writer, "chessboard rim", (0.02, 0.01, 0.007), 0.0, 0.3)
    corner = np.array([0.75, TABLE, 0.42])
    top = shapes.box(np.array([-corner[0], TABLE - 0.035, -corner[2]]), corner, 1.0)
    legs = [
        shapes.box(np.array([x - 0.03, 0.0, z - 0.03]), np.array([x + 0.03, TABLE - 0.035, z + 0.03]), 1.0)
        for x in (-0.68, 0.68)
        for z in (-0.35, 0.35)
    ]
    writer.node("table", mesh=writer.mesh("table", shapes.merge([top, *legs]), wood))
    sheet = shapes.quad(np.array([-0.2, 0.0, -0.2]), np.array([0.4, 0, 0]), np.array([0, 0, 0.4]), (1.0, 1.0))
    slab = shapes.box(np.array([-0.2, -0.0045, -0.2]), np.array([0.2, -0.0003, 0.2]))
    for name, shape, surface in (("chessboard", sheet, squares), ("chessboard slab", slab, rim)):
        writer.node(name, place(0.2, TABLE + 0.0045, 0.06, 0.35), mesh=writer.mesh(name, shape, surface))


def build_subject(writer: GlbWriter) -> None:
    """What stands on the table, and a second vase far behind on the sideboard."""
    color, surface, bumps = (
        {"index": writer.texture(f"vase {part}", pixels, REPEAT)}
        for part, pixels in zip(("colour", "surface", "normals"), textures.vase(512), strict=True)
    )
    glazed = material(writer, "glazed vase", (1, 1, 1), 1.0, 1.0, texture=color, surface=surface, normal=bumps)
    vase = writer.mesh("vase", shapes.lathe(vase_profile(), 80), glazed)
    writer.node("vase", place(*VASE), mesh=vase)
    writer.node("vase far", place(-1.2, 0.72, -2.92, 1.0, 1.5), mesh=vase)

    gold = material(writer, "gold", (1.0, 0.71, 0.29), 1.0, 0.22)
    ebony = material(writer, "ebony", (0.02, 0.017, 0.016), 0.0, 0.18)
    chrome = material(writer, "chrome", (0.55, 0.556, 0.554), 1.0, 0.06)
    pawn, queen = shapes.lathe(pawn_profile(), 28), shapes.lathe(queen_profile(), 32)
    pieces = {
        "gold pawn": (pawn, gold),
        "ebony pawn": (pawn, ebony),
        "gold queen": (queen, gold),
        "ebony queen": (queen, ebony),
    }
    meshes = {name: writer.mesh(name, *piece) for name, piece in pieces.items()}
    standing = {
        "gold queen": ((0.11, 0.10),),
        "gold pawn": ((0.17, 0.16), (0.05, 0.17), (0.24, 0.06)),
        "ebony queen": ((0.27, -0.05),),
        "ebony pawn": ((0.16, -0.04), (0.34, 0.02), (0.22, -0.11)),
    }
    for name, spots in standing.items():
        for x, z in spots:
            writer.node(name, place(x, TABLE + 0.0045, z), mesh=meshes[name])
    writer.node(
        "ball", place(-0.23, TABLE + 0.045, 0.14), mesh=writer.mesh("ball", shapes.sphere(0.045, 48, 28), chrome)
    )

    peel, pores = ({"index": writer.texture(f"citrus {i}", p, REPEAT)} for i, p in enumerate(textures.citrus(256)))
    skin = material(writer, "citrus", (1, 1, 1), 0.0, 0.42, texture=peel, normal=pores)
    orange = writer.mesh("orange", shapes.sphere(0.038, 40, 24), skin)
    for x, z, turn in ((-0.30, -0.06, 0.4), (-0.375, -0.01, 1.7), (-0.34, -0.135, 2.9), (0.45, -0.2, 0.9)):
        writer.node("orange", place(x, TABLE + 0.038, z, turn), mesh=orange)


def build_lights(writer: GlbWriter) -> None:
    """Two strings of small bulbs before the back wall, a sun and two point lights."""
    glass = shapes.sphere(0.011, 12, 8)
    tints = {"warm": (1.0, 0.62, 0.28), "white": (1.0, 0.86, 0.68), "red": (1.0, 0.18, 0.10), "blue": (0.25, 0.5, 1.0)}
    bulbs = []
    for name, tint in tints.items():
        glow = {
            "emissiveFactor": list(tint),
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 24.0}},
        }
        bulbs.append(writer.mesh(f"bulb {name}", glass, material(writer, f"bulb {name}", (0, 0, 0), 0.0, 1.0, **glow)))
    cable = material(writer, "cable", (0.02, 0.03, 0.02), 0.0, 0.6)
    strings = (((-2.0, 1.62), (1.7, 1.72), 0.42, -2.75), ((-1.7, 1.05), (1.9, 1.25), 0.22, -2.45))
    for row, (start, end, sag, z) in enumerate(strings):
        t = np.linspace(0.0, 1.0, 73)
        height = start[1] + (end[1] - start[1]) * t - 4 * sag * t * (1 - t)
        path = np.stack([start[0] + (end[0] - start[0]) * t, height, np.full_like(t, z)], 1)
        writer.node("cable", mesh=writer.mesh("cable", shapes.tube(path, 0.003, 5), cable))
        for k, point in enumerate(path[1::3]):
            mesh = bulbs[(k * 7 + row) % 5 % 4]
            writer.node("bulb", place(point[0], point[1] - 0.013, point[2]), mesh=mesh)

    lights = [
        {"name": "sun", "type": "directional", "color": [1.0, 0.93, 0.82], "intensity": 2.6},
        {"name": "lamp", "type": "point", "color": [1.0, 0.72, 0.45], "intensity": 0.9},
        {"name": "cool fill", "type": "point", "color": [0.6, 0.75, 1.0], "intensity": 1.1},
    ]
    writer.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    for index, eye in enumerate(((2.0, 4.0, 2.2), (-0.75, 1.55, -0.55), (1.5, 1.5, -1.8))):
        aim = look_at(np.array(eye), np.array([0.0, 0.8, 0.0]))
        writer.node(f"{lights[index]['name']}", aim, extensions={"KHR_lights_punctual": {"light": index}})


def build() -> bytes:
    """The whole scene as GLB bytes."""
    writer = GlbWriter("hybrid-dof make_still_life.py")
    writer.add("samplers", {"wrapS": 10497, "wrapT": 10497})
    writer.add("samplers", {"wrapS": 33071, "wrapT": 33071})
    camera = look_at(EYE, TARGET)
    planks = writer.texture("planks", textures.wood(512, 4, 5), REPEAT)
    build_room(writer, planks)
    build_table(writer, planks)
    build_subject(writer)
    build_lights(writer)
    build_branch(writer, camera, CLAMP)
    build_screen(writer, camera)
    add_camera(writer, camera, float(FOV_Y), FOCUS_POINT, APERTURE)
    environment = {"sky": [0.30, 0.34, 0.42], "ground": [0.16, 0.13, 0.11]}
    nodes = list(range(len(writer.json["nodes"])))
    writer.add("scenes", {"nodes": nodes, "extras": {"environment": environment}})
    return finished(writer)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("still_life.glb")
    target.write_bytes(build())
