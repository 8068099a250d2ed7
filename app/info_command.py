"""The command `info`: what loading saw, changed and dropped, and what the scene and its frames take in memory."""

from __future__ import annotations

import argparse
import time
from typing import Any

from . import commands

FRAME_SIZE = (1920, 1080)  # px, for which a frame's memory is told


def info(options: argparse.Namespace) -> int:
    """Say what loading saw, changed and dropped, and what the scene and its frames take in memory."""
    from .bvh.cache import load_or_build
    from .bvh.top import scene_tree
    from .frame.memory import mib
    from .gpu.layout import VERTEX
    from .scene.flatten import bounds, triangles_of
    from .session import open_scene

    scene, triangles = open_scene(options.scene, commands.show_progress)
    report = scene.report
    low, high = bounds(triangles)
    begin = time.perf_counter()
    cache_notes: list[str] = []

    def noted(*geometry: Any) -> Any:
        tree, notes = load_or_build(*geometry)
        cache_notes.extend(notes)
        return tree

    bvh = scene_tree(triangles, noted, commands.show_progress)
    bvh_seconds = time.perf_counter() - begin
    print(
        f"{options.scene}: {report.triangles} triangles, {report.vertices} vertices, loaded in {report.seconds:.2f} s"
    )
    print(
        f"  meshes {len(scene.meshes)}, instances {len(scene.instances)}, materials {len(scene.materials)}, "
        f"images {len(scene.images)}, lights {len(scene.lights)}, cameras {len(scene.cameras)}"
    )
    print(
        f"  bounds from ({low[0]:.3g}, {low[1]:.3g}, {low[2]:.3g}) to ({high[0]:.3g}, {high[1]:.3g}, {high[2]:.3g}) m"
    )
    print(f"  degenerate triangles dropped: {report.degenerate}; drawn: {len(triangles.indices)}")
    print(
        f"  BVH: {bvh.stats.inner_nodes} inner nodes, {bvh.stats.leaves} leaves, depth {bvh.depth}, "
        f"SAH cost {bvh.stats.sah_cost:.1f} triangle tests; "
        f"ready in {bvh_seconds:.2f} s (built in {bvh.stats.seconds:.2f} s)"
    )
    vertex_bytes, index_bytes = VERTEX.itemsize * len(triangles.positions), triangles.indices.nbytes
    bvh_bytes, image_bytes = bvh.nodes.nbytes + (16 + 48) * len(bvh.order), sum(i.pixels.nbytes for i in scene.images)
    print(
        f"  memory: vertices {mib(vertex_bytes)}, indices {mib(index_bytes)}, BVH {mib(bvh_bytes)}, "
        f"images {mib(image_bytes)} (as 8-bit)"
    )
    for line in _frame_lines(scene, triangles):
        print(f"  {line}")
    for moving, count in zip(triangles.moving, triangles_of(triangles), strict=True):
        size = 2.0 * moving.half_size
        print(
            f"  moves: {moving.motion.name or '(unnamed)'}, {count} triangles, {size[0]:.3g} x {size[1]:.3g} x "
            f"{size[2]:.3g} m, every {moving.motion.period:g} s"
        )
    for camera in scene.cameras:
        print(
            f"  camera {camera.name or '(unnamed)'}: {camera.fov_y_deg:.1f} degrees"
            + (f", focus {camera.focus_distance:g} m" if camera.focus_distance else "")
        )
    for note in (*report.notes, *cache_notes):
        print(f"  note: {note}")
    return 0


def _frame_lines(scene: Any, triangles: Any) -> list[str]:
    """What a frame of each view takes, seen by the first camera, still and in motion."""
    from .frame.memory import frame_memory, mib
    from .frame.pipeline import VIEWS, frame_plan
    from .scene.facts import facts_of, frame_facts, near_plane
    from .scene.flatten import bounds
    from .session import focused, viewpoints
    from .settings import Settings

    box = bounds(triangles)
    viewpoint = viewpoints(scene, box)[0]
    settings, near = focused(Settings(), viewpoint), near_plane(*box)
    of_scene = facts_of(scene, triangles)

    def taken(view: str, moves: bool) -> str:
        facts = frame_facts(of_scene, viewpoint.camera, settings.lens, FRAME_SIZE, near, camera_moved=moves)
        return mib(frame_memory(frame_plan(view, settings, facts), FRAME_SIZE).total)

    size = "x".join(map(str, FRAME_SIZE))
    return [f"{view} at {size}: {taken(view, False)}, in motion {taken(view, True)}" for view in VIEWS]
