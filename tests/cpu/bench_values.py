"""A benchmark's results that nobody measured: errors and times by simple laws, in the form that bench.json has."""

from __future__ import annotations

import math
from typing import Any

from app.measure.bench import ALL_REGIONS, VIEWS, checkpoints, not_below, times_values, varied
from app.measure.bench_store import FORMAT
from app.measure.candidates import Candidate, candidates
from app.measure.metrics import Errors, decibels
from app.measure.timing import FrameTimes, times_of
from app.settings import Settings, to_dict

FLOOR = Errors(rmse=0.004, relative_mse=0.002, psnr=45.0, flip=0.006)
CAMERA = {"eye": [0.0, 1.0, 3.0], "target": [0.0, 1.0, 0.0], "up": [0.0, 1.0, 0.0], "fov_y_deg": 45.0}
BIAS = {"sharp": 0.2, "post": 0.07, "hybrid": 0.015, "traced": 0.0}  # that no number of frames removes


def results(*names: str, frames: int = 16, timed: int = 12, slowed: float = 1.0, flip: bool = True) -> dict[str, Any]:
    """Of scenes with these names, every frame `slowed` times slower."""
    return {
        "format": FORMAT,
        "command": "hybrid-dof bench -o out",
        "device": "a device",
        "driver": {},
        "system": "Linux",
        "python": "3.11.0",
        "packages": {"hybrid-dof": "0.1.0", "matplotlib": None},
        "size": [640, 360],
        "frames": frames,
        "timed": timed,
        "spp": 256,
        "seed": 0,
        "time_s": 0.0,
        "views": list(VIEWS),
        "given_settings": {},
        "scenes": [scene(name, frames, timed, slowed, flip) for name in names],
    }


def scene(name: str, frames: int, timed: int, slowed: float, flip: bool) -> dict[str, Any]:
    floor = errors_of(FLOOR.rmse, flip)
    return {
        "name": name,
        "scene": name,
        "camera_file": None,
        "digest": f"of {name}",
        "camera": CAMERA,
        "settings": to_dict(Settings()),
        "reference": {"view": "reference", "spp": 256, "notes": []},
        "floor": {region: not_below(floor, Errors(0.0, 0.0, math.inf, 0.0)) for region in ALL_REGIONS},
        "share": {region: 1.0 if region == "whole" else 0.25 for region in ALL_REGIONS},
        "runs": [run(candidate, frames, timed, slowed, flip) for candidate in candidates(Settings())],
    }


def run(candidate: Candidate, frames: int, timed: int, slowed: float, flip: bool) -> dict[str, Any]:
    of = candidate.settings
    n = {"post": of.post.rings, "hybrid": of.rays.budget, "traced": of.rays.samples_per_frame}.get(candidate.view, 1)
    ms = slowed * {"sharp": 60, "post": 150 + 15 * n, "hybrid": 350 + 40 * n, "traced": 300 * n}[candidate.view]
    noise = {"sharp": 0.02, "post": 0.03 / n, "hybrid": 0.08 / math.sqrt(n), "traced": 0.3 / math.sqrt(n)}
    after = [frame for frame in checkpoints(frames) if candidate.view != "traced" or n * frame <= 64]
    count = timed if ms < 3000 else 1
    return {
        "label": candidate.label,
        "view": candidate.view,
        "varied": varied(candidate),
        "errors": {
            str(frame): {
                region: not_below(
                    errors_of(math.hypot(BIAS[candidate.view], noise[candidate.view] / math.sqrt(frame)), flip),
                    errors_of(FLOOR.rmse, flip),
                )
                for region in ALL_REGIONS
            }
            for frame in after
        },
        "times": times_values(
            FrameTimes(
                frame=times_of([ms * (1.0 + 0.004 * i) for i in range(count)]),
                passes={"gbuffer": times_of([0.2 * ms]), "gather": times_of([0.75 * ms]), "tiny": times_of([0.01 * ms])}
                if count > 1
                else {},
                cpu=times_of([2.0] * count),
                frames=count,
                warm_up=frames,
                source="wall clock after glFinish",
                frame_source="wall clock after glFinish",
                device="a device",
                frame_ms=(ms,) * count,
            )
        ),
    }


def errors_of(rmse: float, flip: bool = True) -> Errors:
    """All metrics by laws that keep their order."""
    return Errors(rmse, 4.0 * rmse, decibels(rmse**2), 0.9 * rmse if flip else math.nan)
