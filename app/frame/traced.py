"""The ground truth, twice: lens rays, and rasterised lens points. Neither shares the other's visibility code."""

from __future__ import annotations

from .mask import trace_defines
from .post import lens_defines
from .records import Pass

TRACED = (
    Pass(
        "traced",
        "rays/progressive.comp",
        updates=("traced", "traced_error"),
        scene=True,
        rays=True,
        sliced=True,
        defines=trace_defines,
    ),
)

REFERENCE = (
    Pass(
        "reference",
        "output/accumulate_mean.comp",
        reads=("color=lit",),
        updates=("reference", "reference_error"),
        defines=lens_defines,
    ),
)
