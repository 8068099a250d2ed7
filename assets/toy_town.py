"""What the toy train passes: painted houses, a clock tower, firs, street lamps, and the wind wheels before the lens."""

from __future__ import annotations

import numpy as np
import shapes
import textures
from glb import GlbWriter
from numpy.typing import NDArray
from staging import material, place, tiled

F64 = NDArray[np.float64]
X, Y, Z = np.eye(3)

HOUSES = (  # x, z, turn [rad], width, depth, storeys, which paint
    (-0.56, -0.22, 0.25, 0.15, 0.12, 2, 0),
    (-0.33, -0.15, 0.08, 0.13, 0.11, 3, 1),
    (-0.16, -0.24, -0.06, 0.12, 0.12, 2, 2),
    (0.20, -0.17, 0.05, 0.14, 0.11, 2, 1),
    (0.37, -0.25, -0.12, 0.13, 0.13, 3, 2),
    (0.57, -0.16, -0.3, 0.16, 0.12, 2, 0),
)
STOREY = 0.065  # m
FIRS = (
    (-0.72, -0.12, 1.1), (-0.45, -0.30, 1.3), (-0.245, -0.34, 1.2), (0.10, -0.33, 1.4), (0.29, -0.36, 1.1),
    (0.47, -0.12, 0.8), (0.72, -0.28, 1.3), (-0.90, -0.45, 1.6), (0.92, -0.50, 1.7), (-0.05, -0.62, 1.5),
)  # fmt: skip  # x, z, size


PLASTER = ((0.06, 0.10), (0.20, 0.10), (0.13, 0.05))  # uvs on a facade between its beams and windows


def triangle(a: F64, b: F64, c: F64, uvs: tuple[tuple[float, float], ...] = PLASTER) -> shapes.Shape:
    """A flat triangle that faces the side from which its corners run counter-clockwise."""
    normal = shapes.unit(np.cross(b - a, c - a))
    return shapes.Shape(np.array([a, b, c]), np.tile(normal, (3, 1)), np.array(uvs, float), np.array([[0, 1, 2]]))


def house(width: float, depth: float, storeys: int) -> tuple[shapes.Shape, shapes.Shape]:
    """(walls with gables, roof) on the ground around the origin, its ridge along x."""
    w, d, h, rise, over = width / 2, depth / 2, storeys * STOREY, 0.62 * depth, 0.012
    sides = [(-X, Z), (X, -Z), (-Z, -X), (Z, X)]  # towards the left seen from outside, outwards
    walls = []
    for left, out in sides:
        half, away = (w, d) if abs(out[2]) else (d, w)
        corner = left * half + out * away + Y * h
        walls.append(shapes.quad(corner, -2 * half * left, -h * Y, (max(1, round(2 * half / 0.065)), storeys)))
    for side in (-1.0, 1.0):
        a, b = np.array([side * w, h, side * d]), np.array([side * w, h, -side * d])
        walls.append(triangle(a, b, np.array([side * w, h + rise, 0.0])))
    roof = []
    for side in (-1.0, 1.0):
        slope = np.array([0.0, -rise, side * d]) * (1 + over / d)
        corner = np.array([-side * (w + over), h + rise, 0.0])
        roof.append(shapes.quad(corner, np.array([2 * side * (w + over), 0, 0]), slope, (2 * width / 0.12, 2.0)))
    return shapes.merge(walls), shapes.merge(roof)


def tower(width: float, height: float) -> tuple[shapes.Shape, shapes.Shape, shapes.Shape]:
    """(stone, clock faces, roof) of a square tower."""
    w, top = width / 2, height + 0.10
    stone = shapes.box(np.array([-w, 0.0, -w]), np.array([w, height, w]), 9.0)
    wide, above = w + 0.006, height + 0.008
    ledge = shapes.box(np.array([-wide, height, -wide]), np.array([wide, above, wide]), 9.0)
    face = 0.9 * width
    dial = shapes.quad(np.array([-face / 2, height - 0.008, w + 0.001]), face * X, -face * Y, (1.0, 1.0))
    eaves = w + 0.008
    ring = [np.array([x * eaves, above, z * eaves]) for x, z in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    uvs = ((0.0, 1.0), (1.0, 1.0), (0.5, 0.0))
    roof = [triangle(a, b, np.array([0.0, top, 0.0]), uvs) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    return shapes.merge([stone, ledge]), dial, shapes.merge(roof)


def build_town(writer: GlbWriter, repeat: int, clamp: int) -> None:
    """Houses, clock tower and firs behind the rails."""
    paints = ((0.72, 0.50, 0.24), (0.66, 0.30, 0.22), (0.40, 0.52, 0.55))
    walls, roofs = [], []
    for k, paint in enumerate(paints):
        color, glow = textures.facade(192, paint, 60 + k)
        lit = {"index": writer.texture(f"windows {k}", glow, repeat)}
        emits = {
            "emissiveTexture": lit,
            "emissiveFactor": [1.0, 1.0, 1.0],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2.2}},
        }
        facade = {"index": writer.texture(f"facade {k}", color, repeat)}
        walls.append(material(writer, f"facade {k}", (1, 1, 1), 0.0, 0.8, texture=facade, **emits))
        tint = ((0.42, 0.14, 0.09), (0.26, 0.24, 0.27), (0.46, 0.22, 0.10))[k]
        tiles = {"index": writer.texture(f"roof {k}", textures.roof_tiles(128, tint, 70 + k), repeat)}
        roofs.append(material(writer, f"roof {k}", (1, 1, 1), 0.0, 0.6, texture=tiles))
    for k, (x, z, turn, width, depth, storeys, paint) in enumerate(HOUSES):
        body, roof = house(width, depth, storeys)
        writer.node(f"house {k}", place(x, 0.0, z, turn), mesh=writer.mesh(f"house {k}", body, walls[paint]))
        writer.node(f"roof {k}", place(x, 0.0, z, turn), mesh=writer.mesh(f"roof {k}", roof, roofs[(paint + k) % 3]))

    stone, dial, spire = tower(0.085, 0.24)
    hands = {"index": writer.texture("clock", textures.clock(256), clamp)}
    face = material(writer, "clock", (1, 1, 1), 0.0, 0.5, texture=hands)
    masonry = material(writer, "tower stone", (0.72, 0.63, 0.50), 0.0, 0.85)
    for name, shape, surface in (("tower", stone, masonry), ("clock", dial, face), ("spire", spire, roofs[1])):
        writer.node(name, place(0.045, 0.0, -0.155, -0.04), mesh=writer.mesh(name, shape, surface))

    needles = material(writer, "fir", (0.05, 0.15, 0.06), 0.0, 0.9)
    tiers = [(0.045, 0.02, 0.075), (0.036, 0.06, 0.065), (0.025, 0.10, 0.06)]
    cones = [shapes.lathe(np.array([(0.0, y), (r, y), (r * 0.5, y + 0.45 * h), (0.0, y + h)]), 14) for r, y, h in tiers]
    trunk = shapes.tube(np.array([[0, 0, 0], [0, 0.015, 0], [0, 0.03, 0.0]]), 0.008, 8)
    fir = writer.mesh("fir", shapes.merge([*cones, trunk]), needles)
    for x, z, size in FIRS:
        writer.node("fir", place(x, 0.0, z, 7 * x, size), mesh=fir)


def build_track(writer: GlbWriter, wood: int) -> None:
    """Two rails on sleepers, on a bed of gravel."""
    steel = material(writer, "rail", (0.58, 0.57, 0.56), 1.0, 0.3)
    timber = material(writer, "sleeper", (0.42, 0.33, 0.26), 0.0, 0.8, texture=tiled(wood, 1.0))
    rails = [shapes.box(np.array([-1.7, 0.006, z - 0.002]), np.array([1.7, 0.012, z + 0.002])) for z in (-0.025, 0.025)]
    sleepers = [
        shapes.box(np.array([x - 0.008, 0.0005, -0.042]), np.array([x + 0.008, 0.006, 0.042]), 8.0)
        for x in np.arange(-1.6, 1.61, 0.05)
    ]
    writer.node("rails", mesh=writer.mesh("rails", shapes.merge(rails), steel))
    writer.node("sleepers", mesh=writer.mesh("sleepers", shapes.merge(sleepers), timber))


def blade(root: float, tip: float, width: float, pitch: float) -> shapes.Shape:
    """A sail along +y, pitched about its own axis [rad], its trailing edge curled towards +z."""
    t, s = (a.ravel() for a in np.meshgrid(np.linspace(0.0, 1.0, 9), np.linspace(-0.5, 0.5, 5)))
    chord = width * (0.35 + 0.65 * np.sin(np.pi * np.clip(0.15 + 0.75 * t, 0, 1)))
    x, z = s * chord * np.cos(pitch), s * chord * np.sin(pitch) + 0.35 * width * (s + 0.5) ** 2
    positions = np.stack([x, root + (tip - root) * t, z], 1)
    normal = np.tile(shapes.unit(np.array([-np.sin(pitch), 0.0, np.cos(pitch)])), (len(t), 1))
    uvs = np.stack([s + 0.5, 1.6 * t], 1)
    return shapes.Shape(positions, normal, uvs, shapes.grid_triangles(5, 9))


def wind_wheel(radius: float, sails: int) -> tuple[shapes.Shape, shapes.Shape]:
    """(sails, hub and rings) in the xy plane around the origin, facing +z."""
    cloth, angle = [], np.linspace(0.0, 2 * np.pi, 97)
    for k in range(sails):
        c, s = np.cos(2 * np.pi * k / sails), np.sin(2 * np.pi * k / sails)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        sail = blade(0.2 * radius, 0.95 * radius, 0.30 * radius, 0.5)
        cloth.append(shapes.Shape(sail.positions @ turn.T, sail.normals @ turn.T, sail.uvs, sail.triangles))
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1)
    rings = [shapes.tube(r * radius * circle, 0.012 * radius, 6) for r in (0.60, 0.97)]
    hub = shapes.sphere(0.13 * radius, 24, 14)
    return shapes.merge(cloth), shapes.merge([hub, *rings])


def build_wheels(writer: GlbWriter, camera: F64, repeat: int) -> list[int]:
    """Two wind wheels on sticks before the lens, in camera space; returns their nodes, which turn about their z."""
    wood = material(writer, "wheel wood", (0.50, 0.30, 0.14), 0.0, 0.5)
    stick = material(writer, "stick", (0.75, 0.66, 0.5), 0.0, 0.6)
    paints = (((0.55, 0.05, 0.06), (0.93, 0.88, 0.76)), ((0.06, 0.16, 0.38), (0.95, 0.80, 0.35)))
    nodes = []
    stands = ((-0.078, -0.006, -0.37, 0.088, 0.35), (0.168, -0.05, -0.50, 0.062, -0.45))
    for k, (x, y, z, radius, yaw) in enumerate(stands):
        cloth = {"index": writer.texture(f"sails {k}", textures.stripes(128, 2, *paints[k]), repeat)}
        sails, hub = wind_wheel(radius, 8 - 2 * k)
        surface = material(writer, f"sails {k}", (1, 1, 1), 0.0, 0.6, texture=cloth)
        parts = [
            writer.node(name, mesh=writer.mesh(name, shape, of))
            for name, shape, of in ((f"sails {k}", sails, surface), (f"hub {k}", hub, wood))
        ]
        nodes.append(writer.node(f"wind wheel {k}", children=parts, rotation=[0.0, 0.0, 0.0, 1.0]))
        stand = place(x, y, z, yaw)
        pole = shapes.tube(np.linspace([0, 0, -0.012], [0, -0.4, -0.012], 3), 0.0035, 10)
        writer.node(f"stand {k}", camera @ stand, children=[nodes[-1]])
        writer.node(f"pole {k}", camera @ stand, mesh=writer.mesh(f"pole {k}", pole, stick))
    return nodes
