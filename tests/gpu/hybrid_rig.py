"""Runs some of the hybrid's passes on arrays made in numpy, with the records, programs and targets of the renderer."""

from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from app.frame.hybrid import HYBRID
from app.frame.post import POST
from app.frame.records import Call, Pass, split_read
from app.frame.targets import BUFFERS, TARGETS, TILE_PX
from app.gpu.layout import FRAME
from app.gpu.programs import Programs
from app.gpu.targets import Targets
from app.scene.facts import Facts
from app.settings import Settings

from .dispatch import run_call

_NUMPY = {"f1": np.uint8, "f2": np.float16, "f4": np.float32}
PASSES = {step.name: step for step in (*POST, *HYBRID)}
SMOOTHING = ("mask_smooth_rows", "mask_smooth_columns")
EDGES = ("edge_tiles", "mask_guide", *SMOOTHING, "mask_edges")
MASKING = (*EDGES, "reach_rows", "reach_columns", "mask_coarse", "mask_rows", "ray_tiles", "mask")
BUDGETING = ("ray_budget", "ray_list")
LAYERS = ("accumulate", "smoothing", "reconstruct", "composite")
LISTING = {"edge_tiles": "EdgeTiles", "ray_tiles": "RayTiles"}


class HybridRig:
    """Passes at one full resolution (width, height). Arrays are (h, w) or (h, w, c), bottom row first."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int], settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self.targets, self.programs = Targets(ctx, size), Programs(ctx)
        self._ctx, self._size = ctx, size
        self._block = ctx.buffer(reserve=FRAME.itemsize)
        self._given: set[str] = set()

    def __enter__(self) -> HybridRig:
        return self

    def __exit__(self, *_: object) -> None:
        self.targets.release()
        self.programs.release()
        self._block.release()

    def give(self, previous: bool = False, **arrays: np.ndarray) -> None:
        """Fill targets (or, with `previous`, last frame's values) by name."""
        self._given |= arrays.keys()
        for name, array in arrays.items():
            texture = self.targets.texture(name, previous)
            wanted = (texture.height, texture.width, texture.components)
            array = np.asarray(array, _NUMPY[TARGETS[name].dtype]).reshape(wanted)
            texture.write(np.ascontiguousarray(array).tobytes(), alignment=1)

    def run(self, *names: str, everywhere: bool = False, **frame: object) -> None:
        """Run passes in the given order, over the tiles that they are for or, `everywhere`, over all; `frame` sets
        fields of the uniform block beside those of the settings.
        """
        if not everywhere and any(PASSES[n].over == "RayTiles" for n in names) and "ray_tiles" not in names:
            names = ("ray_tiles", *names)
        self._block.write(self._frame(frame).tobytes())
        for name in {block for n in names for block in PASSES[n].fills}:
            self.targets.begin_buffer(name)
        for name in ("kernel", *names):
            if everywhere and name in LISTING:
                self._list_all_tiles(LISTING[name])
            else:
                self._run(PASSES[name])
                self._given |= {*PASSES[name].writes}

    def swap(self) -> None:
        """End of frame: what was written becomes history."""
        for target in {t for step in HYBRID for t in step.history}:
            self.targets.swap(target)

    def read(self, name: str) -> np.ndarray:
        """Texels (h, w, c) as float64."""
        return self.targets.read(name).astype(np.float64)

    def block(self, name: str, dtype: str = "<u4") -> np.ndarray:
        """A storage block's words."""
        return np.frombuffer(self.targets.buffer(name).read(), dtype).astype(np.float64 if "f" in dtype else np.int64)

    def _list_all_tiles(self, block: str) -> None:
        """As if every tile were of the last class."""
        columns, rows = (-(-side // TILE_PX) for side in self._size)
        y, x = np.indices((rows, columns), "<u4")
        count, classes = x.size, BUFFERS[block].header // 16
        heads = np.zeros((classes, 4), "<u4") + np.array([0, 1, 1, 0], "<u4")
        heads[-1] = count, 1, 1, count
        lists = np.zeros((classes, count), "<u4")
        lists[-1] = (x | y << 16).ravel()
        self.targets.buffer(block).write(heads.tobytes() + lists.tobytes())

    def _frame(self, fields: Mapping[str, object]) -> np.ndarray:
        s = self.settings
        values = {
            "size_px": self._size,
            "inverse_size": (1 / self._size[0], 1 / self._size[1]),
            "max_coc_px": s.post.max_coc * self._size[1],
            "mask_sensitivity": s.mask.sensitivity,
            "mask_threshold": s.mask.threshold,
            "mask_smoothing": s.mask.smoothing,
            "ray_budget": s.rays.budget,
            "max_rays": s.rays.max_per_pixel,
            "focus_blend": s.rays.focus_blend,
            "history_alpha": s.rays.history,
            "reconstruct_radius": s.reconstruct.radius,
            "lens_anamorphic": s.lens.anamorphic,
            "blend_hit_ratio": s.blend.hit_ratio,
            "blend_specular": s.blend.specular,
        }
        block = np.zeros((), FRAME)
        for field, value in {**values, **fields}.items():
            block[field] = value
        return block

    def _run(self, step: Pass) -> None:
        facts = Facts(near_coc_px=50.0, far_coc_px=50.0)
        present = tuple(r for r in step.optional if split_read(r)[1] in self._given)
        reads = tuple(split_read(r) for r in (*step.reads, *present))
        has = tuple((f"HAS_{split_read(r)[0].upper()}", int(r in present)) for r in step.optional)
        defines, kernels = (*step.defines(self.settings, facts), *has), step.kernels(self.settings, facts)
        call = Call(step, reads, step.writes, defines, "", kernels=kernels)
        run_call(self._ctx, call, self.programs, self.targets, self._block)
