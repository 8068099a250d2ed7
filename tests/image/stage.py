"""A scene opened once per session, and pictures of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import moderngl
import numpy as np

from app.bvh.build import build_bvh
from app.bvh.top import scene_tree
from app.camera import Camera, Moment, read_viewpoint
from app.frame.pipeline import CONVERGING
from app.gpu.scene import GpuScene
from app.gpu.timing import WALL_CLOCK
from app.renderer import Renderer
from app.scene.flatten import flatten
from app.scene.model import Scene
from app.session import focused, load_gpu_scene, viewpoints
from app.settings import Settings, from_dict, put

BATCH = 16  # lens samples per dispatch: the cost of starting one is spread, and no dispatch takes long


@dataclass
class Stage:
    """One scene, one viewpoint, one renderer whose programs stay compiled."""

    renderer: Renderer
    camera: Camera
    settings: Settings

    def draw(
        self,
        view: str,
        size: tuple[int, int],
        *,
        frames: int = 1,
        spp: int = 1,
        seed: int = 0,
        settings: Settings | None = None,
        camera: Camera | None = None,
        time_s: float = 0.0,
    ) -> Renderer:
        """The renderer after a fresh start and `frames` frames of a view, or `spp` lens samples of a converging one."""
        batch = min(spp, BATCH) if view == "traced" else 1
        assert spp % batch == 0
        used = put(settings or self.settings, "rays.samples_per_frame", batch)
        still = [Moment(camera or self.camera, time_s)] * (spp // batch if view in CONVERGING else frames)
        for _ in self.frames(view, size, still, seed=seed, settings=used):
            pass
        return self.renderer

    def frames(
        self,
        view: str,
        size: tuple[int, int],
        moments: Iterable[Moment],
        *,
        seed: int = 0,
        settings: Settings | None = None,
    ) -> Iterator[Renderer]:
        """The renderer after a fresh start and each frame of a view, one a moment, drawn when it is asked for.

        Finish one sequence before the next begins: all that is drawn of a scene shares its renderer.
        """
        renderer = self.renderer
        renderer.resize(size)
        renderer.reset()
        renderer.seed = seed
        for moment in moments:
            renderer.draw(view, moment.camera, settings or self.settings, time_s=moment.time_s)
            yield renderer

    def linear(self, view: str, size: tuple[int, int], **options: object) -> np.ndarray:
        """Linear radiance (h, w, 3) float64, top row first."""
        return self.draw(view, size, **options).linear().astype(np.float64)  # type: ignore[arg-type]

    def runs(self, view: str, size: tuple[int, int], spp: int, seeds: Sequence[int], **options: object) -> np.ndarray:
        """Independent estimates (len(seeds), h, w, 3) of a converging view."""
        return np.stack([self.linear(view, size, spp=spp, seed=seed, **options) for seed in seeds])


def stage_of(ctx: moderngl.Context, scene: Scene, camera: Camera, **settings: object) -> Stage:
    """A scene made in the test; settings by dotted name with "__" for the dot."""
    triangles = flatten(scene)
    gpu = GpuScene(ctx, scene, triangles, partial(scene_tree, triangles, build_bvh))
    return Stage(untimed(ctx, gpu), camera, with_settings(Settings(), settings))


@cache
def opened(ctx: moderngl.Context, name: str, camera_file: Path | None = None, unlit: bool = False) -> Stage:
    """A built-in scene or a file, seen by a camera file or by the scene's own first camera."""
    scene, renderer = loaded(ctx, name)
    low, high = (np.array(corner) for corner in (renderer.scene.facts.low, renderer.scene.facts.high))
    viewpoint = read_viewpoint(camera_file) if camera_file else viewpoints(scene, (low, high))[0]
    settings = with_settings(
        Settings(), {"shading__mode": "unlit", "shading__background": [0.5, 0.6, 0.7]} if unlit else {}
    )
    return Stage(renderer, viewpoint.camera, focused(settings, viewpoint))


@cache
def loaded(ctx: moderngl.Context, name: str) -> tuple[Scene, Renderer]:
    """A built-in scene or a file, and its one renderer: views of it from several cameras share its programs."""
    scene, gpu = load_gpu_scene(ctx, name)
    return scene, untimed(ctx, gpu)


def untimed(ctx: moderngl.Context, gpu: GpuScene) -> Renderer:
    """A renderer that times nothing; its size is set by `Stage.draw`."""
    renderer = Renderer(ctx, gpu, (8, 8), timing_source=WALL_CLOCK)
    renderer.profiler.enabled = False
    return renderer


def with_settings(settings: Settings, values: dict[str, object]) -> Settings:
    """Settings with values by dotted name, "__" for the dot."""
    return from_dict({path.replace("__", "."): value for path, value in values.items()}, settings)
