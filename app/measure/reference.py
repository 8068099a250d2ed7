"""The true picture to measure against, and how true it is.

It is drawn as two independent halves of as many lens points each, by rasterising (the `reference` view, which shares no
visibility code with the rays it judges and costs a fifth of them) or by tracing rays (`traced`).

**The noise floor.** With the truth T and halves A = T + a, B = T + b of independent noise with variance v, the
reference R = (A + B) / 2 is off by R - T = (a + b) / 2, of variance v/2. One half is off from R by A - R = (a - b) / 2,
of variance v/2 as well: a half differs from the reference as much as the truth itself does. So what any metric says of
a half is what it would say of a picture without error, and a difference smaller than that means nothing. The floor is
measured from one pair of halves and is as uncertain as that: halves of few lens points share their noise between
pixels, which then do not average.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..cache import FAILURES, cache_folder, drop_oldest, used, write_arrays
from ..camera import Camera, Moment
from ..errors import UserError
from ..gpu.context import Context, device_name
from ..renderer import Renderer
from ..settings import Settings, put
from . import store
from .metrics import Errors, Mask, measure
from .regions import region_labels, region_masks
from .shares import LensShares
from .steps import driven

VIEWS = ("reference", "traced")
SEEDS = (1000, 1001)  # one a half; far from the seeds of what is measured
TRACE_BATCH = 4  # lens samples a dispatch: keeps the device busy, and is short enough for its watchdog
SHARE_POINTS = 256  # lens points that tell a traced reference's regions: five of them are the 2 % that divide them

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Reference:
    """Two independent halves of one converged picture, and what its pixels see through the lens."""

    halves: NDArray[np.float32]  # (2, h, w, 3) linear radiance, top row first
    near: NDArray[np.float32]  # (h, w) share of the lens that sees something nearer than the focus zone
    far: NDArray[np.float32]  # (h, w) share that sees something farther
    notes: tuple[str, ...] = ()  # what went wrong with the cache

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.halves.shape[2], self.halves.shape[1]

    @cached_property
    def picture(self) -> NDArray[np.float64]:
        """Linear radiance (h, w, 3), top row first: the mean of the halves."""
        return np.asarray(self.halves.mean(0, dtype=np.float64))

    @cached_property
    def labels(self) -> NDArray[np.uint8]:
        """The region (h, w) of each pixel, as an index into regions.REGIONS."""
        return region_labels(self.near, self.far)

    @cached_property
    def regions(self) -> dict[str, Mask]:
        """The pixels (h, w) of each region by name."""
        return region_masks(self.labels)

    @cached_property
    def floor(self) -> dict[str, Errors]:
        """What a picture without any error would show, over the whole and each region (see the top of this file)."""
        return self.errors(self.halves[0])

    def errors(self, picture: NDArray[np.float32], *, flip: bool = True) -> dict[str, Errors]:
        """Every metric of a linear picture (h, w, 3), over the whole and each region."""
        return measure(picture, self.picture, self.regions, flip=flip)


def reference(
    ctx: Context,
    renderer: Renderer,
    camera: Camera,
    settings: Settings,
    spp: int,
    *,
    scene: str,
    time_s: float = 0.0,
    view: str = "reference",
    folder: Path | None = None,
    progress: Progress | None = None,
) -> Reference:
    """The converged picture at the renderer's size, from the cache or drawn and kept there.

    `scene` is a digest of the scene (store.scene_digest); `spp` lens points in all, an even number; `folder` another
    place than the user's cache. Raises UserError for another view or an odd number.
    """
    _check(view, spp)
    where = folder or cache_folder("references")
    moment = Moment(camera, time_s)
    key = store.reference_key(device_name(ctx), scene, view, renderer.size, spp, moment, settings)
    path, notes = where / (key + store.SUFFIX), []
    if path.is_file():
        try:
            kept = _read(path, renderer.size)
            used(path)
            return kept
        except FAILURES as error:
            notes.append(f"the kept reference {path.name} is unreadable and was drawn again ({error})")
    tell = partial(progress, "reference") if progress else None
    drawn = driven(drawing(renderer, camera, settings, spp, time_s=time_s, view=view), tell)
    try:
        write_arrays(path, halves=drawn.halves, near=drawn.near, far=drawn.far)
        drop_oldest(where, store.SUFFIX, store.SIZE_LIMIT)
    except FAILURES as error:
        notes.append(f"the reference could not be kept ({error})")
    return Reference(drawn.halves, drawn.near, drawn.far, tuple(notes))


def drawing(
    renderer: Renderer,
    camera: Camera,
    settings: Settings,
    spp: int,
    *,
    time_s: float = 0.0,
    view: str = "reference",
) -> Generator[float, None, Reference]:
    """Draw a reference a frame at a time: yields the part that is done, 0 to 1, and returns the Reference.

    Nothing else may be drawn with the renderer meanwhile; its seed and profiler are as before afterwards.
    """
    _check(view, spp)
    counted = view == "reference"  # whose own frames tell what is near and far
    batches = _batches(spp // 2, 1 if counted else TRACE_BATCH)
    points = 0 if counted else min(SHARE_POINTS, spp)
    total, done = 2 * len(batches) + points, 0
    halves: list[NDArray[np.float32]] = []
    shares = LensShares(renderer.size, settings.lens, camera)
    before = renderer.seed, renderer.profiler.enabled
    renderer.profiler.enabled = False
    try:
        for seed in SEEDS:
            _begin(renderer, shares, seed)
            for samples in batches:
                of_batch = put(settings, "rays.samples_per_frame", samples)
                while not renderer.ready(view, camera, of_batch, time_s=time_s):
                    yield done / total
                renderer.draw(view, camera, of_batch, time_s=time_s)
                if counted:
                    shares.add(renderer)
                done += 1
                yield done / total
            halves.append(renderer.linear())
        _begin(renderer, shares, SEEDS[0])
        for _ in range(points):
            while not renderer.ready("reference", camera, settings, time_s=time_s):
                yield done / total
            renderer.draw("reference", camera, settings, time_s=time_s)
            shares.add(renderer)
            done += 1
            yield done / total
    finally:
        renderer.seed, renderer.profiler.enabled = before
        renderer.reset()
    return Reference(np.stack(halves), *shares.shares)


def _begin(renderer: Renderer, shares: LensShares, seed: int) -> None:
    renderer.reset()
    renderer.seed = seed
    shares.restart()


def _batches(total: int, batch: int) -> list[int]:
    return [batch] * (total // batch) + [total % batch] * (total % batch > 0)


def _check(view: str, spp: int) -> None:
    if view not in VIEWS:
        raise UserError(f"{view!r} is no reference; choose one of {', '.join(VIEWS)}")
    if spp < 2 or spp % 2:
        raise UserError(f"a reference of {spp} samples has no two halves; give an even number from 2")


def _read(path: Path, size: tuple[int, int]) -> Reference:
    with np.load(path, allow_pickle=False) as data:
        kept = Reference(data["halves"], data["near"], data["far"])
    shape = size[1], size[0]
    if kept.halves.shape != (2, *shape, 3) or kept.near.shape != shape or kept.far.shape != shape:
        raise ValueError("the arrays do not fit the picture")
    return kept
