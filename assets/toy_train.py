"""A wooden toy train that runs along +x: an engine with turning wheels and two wagons. Metres, rails at height 0."""

from __future__ import annotations

import itertools

import numpy as np
import shapes
from glb import GlbWriter
from numpy.typing import NDArray
from staging import material, tiled

F64 = NDArray[np.float64]

GAUGE = 0.05  # between the middles of the wheels
WAGON_WHEEL = 0.013  # radius


def rotated(shape: shapes.Shape, matrix: F64, offset: tuple[float, float, float]) -> shapes.Shape:
    """The shape turned by a 3x3 rotation and moved."""
    return shapes.Shape(
        shape.positions @ matrix.T + np.array(offset), shape.normals @ matrix.T, shape.uvs, shape.triangles
    )


ALONG_X = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # what stood upright lies along +x
ALONG_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # ... along +z


def turned(profile: list[tuple[float, float]], segments: int = 28) -> shapes.Shape:
    """A body of revolution with sharp edges: each corner of the outline is doubled."""
    pieces = [shapes.lathe(np.linspace(a, b, 3), segments) for a, b in itertools.pairwise(profile) if a != b]
    return shapes.merge(pieces)


def block(low: tuple[float, float, float], high: tuple[float, float, float], uv: float = 12.0) -> shapes.Shape:
    """A box, textured `uv` times a metre."""
    return shapes.box(np.array(low), np.array(high), uv)


def spoked_axle(radius: float) -> shapes.Shape:
    """Two spoked wheels on an axle along z, around the origin."""
    half = 0.5 * GAUGE
    parts = [rotated(turned([(0.0, -half), (0.003, -half), (0.003, half), (0.0, half)], 10), ALONG_Z, (0, 0, 0))]
    for side in (-half, half):
        t, r = 0.003, radius
        tyre = [(r - 0.004, -t), (r, -t), (r, t), (r - 0.004, t), (r - 0.004, -t)]
        hub = [(0.0, -t), (0.0045, -t), (0.0045, t), (0.0, t)]
        parts += [rotated(turned(outline, 28), ALONG_Z, (0, 0, side)) for outline in (tyre, hub)]
        for k in range(5):
            angle = 2 * np.pi * k / 5
            end = [(r - 0.003) * np.cos(angle), (r - 0.003) * np.sin(angle), side]
            parts.append(shapes.tube(np.linspace([0, 0, side], end, 3), 0.0019, 6))
    return shapes.merge(parts)


def build_train(writer: GlbWriter, wheel: float, stripes: int, wood: int) -> tuple[int, list[int]]:
    """(node of the train, its turning axles) around the middle of the engine's footprint; `wheel` is their radius."""
    red = material(writer, "engine red", (0.62, 0.05, 0.04), 0.0, 0.28)
    black = material(writer, "engine black", (0.025, 0.025, 0.03), 0.0, 0.35)
    brass = material(writer, "brass", (0.93, 0.68, 0.30), 1.0, 0.24)
    timber = material(writer, "wagon timber", (1.0, 0.9, 0.75), 0.0, 0.5, texture=tiled(wood, 1.0))
    canvas = material(writer, "wagon canvas", (1, 1, 1), 0.0, 0.7, texture={"index": stripes})

    barrel = turned([(0.0, 0.0), (0.021, 0.0), (0.021, 0.088), (0.017, 0.094), (0.0, 0.094)])
    hoops = [turned([(0.021, x), (0.0222, x), (0.0222, x + 0.004), (0.021, x + 0.004)]) for x in (0.012, 0.046, 0.08)]
    boiler, *bands = (rotated(shape, ALONG_X, (-0.028, 0.056, 0)) for shape in (barrel, *hoops))
    chimney = turned([(0.0, 0.0), (0.0075, 0.0), (0.0065, 0.026), (0.012, 0.033), (0.012, 0.038), (0.0, 0.038)])
    dome = shapes.sphere(0.010, 20, 12)
    posts = itertools.product((-0.074, -0.032), (-0.022, 0.022))
    cab = [block((x - 0.003, 0.058, z - 0.003), (x + 0.003, 0.092, z + 0.003)) for x, z in posts]
    cab.append(block((-0.078, 0.028, -0.026), (-0.028, 0.058, 0.026)))
    roof = block((-0.085, 0.092, -0.031), (-0.021, 0.098, 0.031))
    frame = block((-0.082, 0.019, -0.018), (0.075, 0.029, 0.018))
    buffer = block((0.072, 0.016, -0.026), (0.078, 0.030, 0.026))
    lamp = rotated(turned([(0.0, 0.0), (0.007, 0.0), (0.009, 0.008), (0.0, 0.008)], 18), ALONG_X, (0.066, 0.080, 0))

    bodies = {
        "engine": ([boiler, *cab, buffer], red),
        "engine iron": ([rotated(chimney, np.eye(3), (0.048, 0.074, 0)), roof, frame], black),
        "engine brass": ([*bands, rotated(dome, np.eye(3), (0.008, 0.079, 0)), lamp], brass),
    }
    beds, covers, irons = [], [], []
    for x in (-0.172, -0.322):
        beds.append(block((x - 0.064, 0.022, -0.027), (x + 0.064, 0.032, 0.027)))
        beds += [block((x - 0.064, 0.032, z - 0.002), (x + 0.064, 0.052, z + 0.002)) for z in (-0.025, 0.025)]
        beds += [block((e - 0.002, 0.032, -0.025), (e + 0.002, 0.052, 0.025)) for e in (x - 0.062, x + 0.062)]
        arc = np.linspace(0.0, np.pi, 13)
        tilt = np.stack([np.zeros(13), 0.050 + 0.034 * np.sin(arc), -0.026 * np.cos(arc)], 1)
        covers.append(_vault(tilt, x - 0.060, x + 0.060))
        for wheel_x in (x - 0.038, x + 0.038):
            irons.append(rotated(spoked_axle(WAGON_WHEEL), np.eye(3), (wheel_x, WAGON_WHEEL, 0)))
        irons.append(block((x + 0.062, 0.024, -0.003), (x + 0.092, 0.028, 0.003)))  # the coupling ahead
    bodies |= {"wagons": (beds, timber), "wagon covers": (covers, canvas), "wagon iron": (irons, black)}
    children = [writer.node(name, mesh=writer.mesh(name, shapes.merge(s), m)) for name, (s, m) in bodies.items()]
    axle = writer.mesh("engine wheels", spoked_axle(wheel), red)
    axles = [writer.node(f"axle {k}", mesh=axle, translation=[x, wheel, 0.0]) for k, x in enumerate((-0.045, 0.035))]
    return writer.node("train", children=[*children, *axles]), axles


def _vault(outline: F64, start: float, end: float) -> shapes.Shape:
    """A cylinder cap over an outline (k, 3) in the yz plane, from `start` to `end` along x."""
    k = len(outline)
    along = np.linspace(0.0, 1.0, k)
    positions = np.concatenate([outline + np.array([x, 0, 0]) for x in (start, end)])
    slope = np.gradient(outline, axis=0)
    normal = shapes.unit(np.stack([np.zeros(k), slope[:, 2], -slope[:, 1]], 1))
    uvs = np.concatenate([np.stack([np.full(k, u), along], 1) for u in (0.0, 1.4)])
    return shapes.Shape(positions, np.concatenate([normal, normal]), uvs, shapes.grid_triangles(2, k))
