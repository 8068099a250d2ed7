"""Runs the post-process on pictures made in numpy: the renderer's passes, plan and programs, without a scene."""

from __future__ import annotations

import math

import moderngl
import numpy as np

from app.frame.plan import plan
from app.frame.post import POST
from app.frame.records import Pass
from app.gpu.layout import FRAME
from app.gpu.programs import Programs
from app.gpu.targets import Targets
from app.scene.facts import Facts
from app.settings import Settings, ShadingMode, put

from .dispatch import run_call

GIVEN = Pass("given", "", writes=("lit", "coc"))
UNLIT = put(Settings(), "shading.mode", ShadingMode.UNLIT)


class PostRig:
    """The post-process at one size (width, height) and one set of settings. Arrays are (h, w, c), bottom row first."""

    def __init__(
        self, ctx: moderngl.Context, size: tuple[int, int], settings: Settings = UNLIT, max_coc_px: float = 40.0
    ) -> None:
        self.ctx, self.size, self.settings, self.max_coc_px = ctx, size, settings, max_coc_px
        self.targets, self.programs = Targets(ctx, size), Programs(ctx)
        self.block = ctx.buffer(reserve=FRAME.itemsize)
        self.plan = plan((GIVEN, *POST), "post", settings, Facts(near_coc_px=max_coc_px, far_coc_px=max_coc_px))

    def __enter__(self) -> PostRig:
        return self

    def __exit__(self, *_: object) -> None:
        self.targets.release()
        self.programs.release()
        self.block.release()

    def run(self, lit: np.ndarray, coc: np.ndarray, frame_index: int = 0) -> np.ndarray:
        """`post` for radiance (h, w, 3 or 4) and signed CoC radii (h, w) [px]."""
        height, width = coc.shape
        radiance = np.zeros((height, width, 4), np.float16)
        radiance[..., : lit.shape[-1]] = lit
        self.targets.texture("lit").write(radiance.tobytes())
        self.targets.texture("coc").write(coc.astype(np.float32).tobytes())
        self.block.write(self._frame(frame_index).tobytes())
        for name in {block for call in self.plan.calls for block in call.step.fills}:
            self.targets.begin_buffer(name)
        for call in self.plan.calls[1:]:
            run_call(self.ctx, call, self.programs, self.targets, self.block)
        return self.read("post")

    def mean(self, lit: np.ndarray, coc: np.ndarray, frames: int) -> np.ndarray:
        """The mean of `post` over frames, as the resolve pass accumulates it for a still camera."""
        return np.mean([self.run(lit, coc, i) for i in range(frames)], axis=0)

    def read(self, target: str) -> np.ndarray:
        """A target's texels (h, w, c) as float64."""
        return self.targets.read(target).astype(np.float64)

    def _frame(self, index: int) -> np.ndarray:
        lens = self.settings.lens
        block = np.zeros((), FRAME)
        block["size_px"], block["frame_index"], block["max_coc_px"] = self.size, index, self.max_coc_px
        block["layer_fade_px"] = self.settings.post.layer_fade
        block["lens_anamorphic"], block["lens_rotation"] = lens.anamorphic, math.radians(lens.rotation)
        block["lens_aberration"], block["lens_cat_eye"] = lens.spherical_aberration, lens.cat_eye
        return block
