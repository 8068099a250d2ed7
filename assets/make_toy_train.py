"""Makes toy_train.glb, the built-in scene that moves: `python assets/make_toy_train.py [OUT.glb]`.

A toy train crosses a painted town, which is in focus. Two wind wheels turn close before the lens, which sees the town
between their sails: partial occlusion that never stands still. Far behind hang strings of small bright bulbs. Same
input, same bytes. Lengths in metres, times in seconds, colours of factors linear.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import shapes
import textures
from glb import GlbWriter
from staging import add_camera, finished, look_at, material, place, tiled
from toy_town import build_town, build_track, build_wheels
from toy_train import build_train

EYE, TARGET = np.array([0.03, 0.26, 1.20]), np.array([0.0, 0.095, 0.0])
FOV_Y = np.radians(32.0)
FOCUS_POINT = np.array([0.0, 0.06, 0.026])  # the side of the engine that faces the lens
APERTURE = 0.04  # the nearer wheel blurs over 25 px of 360
PERIOD = 8.0  # s, of all that moves
WAY = 2.2  # m that the train runs in a period: from beyond one edge of the picture to beyond the other
START = 0.15  # where the engine stands at time 0
TURNS = 18  # of the engine's wheels on that way: whole, so that the loop closes
RAIL = 0.012  # height of the rails' top
REPEAT, CLAMP = 0, 1  # samplers


def build_stage(writer: GlbWriter) -> None:
    """The meadow and the painted backdrop."""
    grass = writer.texture("meadow", textures.meadow(256), REPEAT)
    evening = writer.texture("dusk", textures.dusk(1024, 256), CLAMP)
    ground = shapes.quad(np.array([-2.6, 0.0, -2.2]), np.array([5.2, 0, 0]), np.array([0, 0, 3.6]), (5.2, 3.6), 4)
    sky = shapes.quad(np.array([-2.0, 0.98, -2.1]), np.array([4.0, 0, 0]), np.array([0, -1.0, 0]), (1.0, 1.0), 4)
    turf = material(writer, "meadow", (1, 1, 1), 0.0, 0.95, texture=tiled(grass, 3.0))
    canvas = material(writer, "backdrop", (1, 1, 1), 0.0, 1.0, texture={"index": evening})
    for name, shape, surface in (("meadow", ground, turf), ("backdrop", sky, canvas)):
        writer.node(name, mesh=writer.mesh(name, shape, surface))


def build_lights(writer: GlbWriter) -> None:
    """Strings of bulbs before the backdrop, and a low sun."""
    glass = shapes.sphere(0.009, 12, 8)
    tints = {"warm": (1.0, 0.62, 0.28), "white": (1.0, 0.86, 0.68), "red": (1.0, 0.20, 0.10), "green": (0.3, 1.0, 0.4)}
    bulbs = []
    for name, tint in tints.items():
        strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 26.0}}
        glow = {"emissiveFactor": list(tint), "extensions": strength}
        bulbs.append(writer.mesh(f"bulb {name}", glass, material(writer, f"bulb {name}", (0, 0, 0), 0.0, 1.0, **glow)))
    strings = (((-1.3, 0.50), (1.2, 0.42), 0.16, -1.7), ((-1.1, 0.34), (1.35, 0.36), 0.12, -1.5))
    for row, (start, end, sag, z) in enumerate(strings):
        t = np.linspace(0.0, 1.0, 20)
        for k, s in enumerate(t):
            x, y = start[0] + (end[0] - start[0]) * s, start[1] + (end[1] - start[1]) * s - 4 * sag * s * (1 - s)
            writer.node("bulb", place(x, y, z), mesh=bulbs[(k * 7 + 2 * row) % 5 % 4])
    sun = {"name": "sun", "type": "directional", "color": [1.0, 0.84, 0.62], "intensity": 3.8}
    writer.json["extensions"] = {"KHR_lights_punctual": {"lights": [sun]}}
    aim = look_at(np.array([-1.4, 1.5, 1.9]), np.zeros(3))
    writer.node("sun", aim, extensions={"KHR_lights_punctual": {"light": 0}})


def build_motion(writer: GlbWriter, wheels: list[int], train: int, axles: list[int]) -> None:
    """The train runs along, and jumps back while it is out of sight; its axles roll; the wind wheels turn."""
    ends = np.array([0.0, PERIOD])
    writer.animate(train, "translation", ends, np.array([[START, RAIL, 0.0], [START + WAY, RAIL, 0.0]]))
    line = writer.node("line", children=[train], translation=[0.0, 0.0, 0.0])
    halves = np.array([0.0, 0.5 * PERIOD])
    writer.animate(line, "translation", halves, np.array([[0.0, 0.0, 0.0], [-WAY, 0.0, 0.0]]), "STEP")
    for node, turns in (*((axle, -TURNS) for axle in axles), (wheels[0], 2), (wheels[1], -3)):
        thirds = np.arange(3 * abs(turns) + 1) / 3  # of a turn: arcs below half a turn have one shortest way
        half = np.sign(turns) * np.pi * thirds
        quaternions = np.stack([np.zeros_like(half), np.zeros_like(half), np.sin(half), np.cos(half)], 1)
        writer.animate(node, "rotation", PERIOD * thirds / abs(turns), quaternions)


def build() -> bytes:
    """The whole scene as GLB bytes."""
    writer = GlbWriter("hybrid-dof make_toy_train.py")
    writer.add("samplers", {"wrapS": 10497, "wrapT": 10497})
    writer.add("samplers", {"wrapS": 33071, "wrapT": 33071})
    camera = look_at(EYE, TARGET)
    wood = writer.texture("wood", textures.wood(128, 2, 8), REPEAT)
    canvas = writer.texture("canvas", textures.stripes(128, 3, (0.10, 0.30, 0.22), (0.90, 0.84, 0.66)), REPEAT)
    build_stage(writer)
    build_town(writer, REPEAT, CLAMP)
    build_track(writer, wood)
    build_lights(writer)
    train, axles = build_train(writer, WAY / (2 * np.pi * TURNS), canvas, wood)
    build_motion(writer, build_wheels(writer, camera, REPEAT), train, axles)
    add_camera(writer, camera, float(FOV_Y), FOCUS_POINT, APERTURE)
    environment = {"sky": [0.36, 0.38, 0.50], "ground": [0.17, 0.16, 0.12]}
    writer.add("scenes", {"nodes": writer.roots(), "extras": {"environment": environment}})
    return finished(writer)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("toy_train.glb")
    target.write_bytes(build())
