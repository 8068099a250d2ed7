"""One frame on one page: the stages in order, and which target each view looks at.

    sharp      gbuffer > lighting                                                   > resolve > display
    post       gbuffer > lighting > coc > tiles > gather ... > post                 > resolve > display
    hybrid     ... tiles > scout > mask > gather ... > post
               > ray list > trace > accumulate > reconstruct > composite                       > resolve > display
    traced     progressive lens rays, a running mean                                          > display
    reference  gbuffer > lighting through one lens point a frame, a running mean              > display

Full resolution: gbuffer, lighting, coc, post, composite and what follows. Half: from downsample to median, and from
mask to reconstruct.
One texel per 16x16 px: the tiles, by which blur, edges and rays are listed. The table in targets.py has each target's
scale and meaning.

Any other target's name is a view too: the plan then holds just the passes that target needs, and the viewer paints it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from ..errors import UserError
from ..scene.facts import Facts
from ..settings import Settings
from .hybrid import TRACING
from .lifetimes import PICKED
from .mask import MASKING, partly_occluded
from .output import display_pass, resolve_pass, show_pass
from .plan import plan
from .post import GATHERING, TILES, blurred
from .raster import RASTER
from .records import FramePlan
from .targets import TARGETS
from .traced import REFERENCE, TRACED

VIEWS = {
    "sharp": "what a pinhole sees",
    "post": "depth of field as a post-process (after Jimenez 2014)",
    "hybrid": "post-process, with rays where the raster image lacks what the lens sees (Tan et al. 2020)",
    "traced": "ground truth: rays distributed over the lens",
    "reference": "ground truth again, by rasterising from many lens points",
}
# Views of running means: they start afresh when camera or objects move, and need no temporal anti-aliasing.
LENS_RAYS = TRACED[0].updates
LENS_POINTS = REFERENCE[0].updates
CONVERGING = (*LENS_RAYS, *LENS_POINTS)

# Targets that can be looked at beside the views.
VIEWABLE = tuple(name for name in TARGETS if name not in VIEWS and name not in ("display", "resolved"))

OF_MOTION = ("motion", "gradient")  # targets that are written while something moves

ASKED_FOR = "it is what was asked for; while nothing moves it finds nothing"

# The mask before the gather: the normals that it reads are full resolution, and so is what the post-process writes.
PASSES = (*RASTER, *TILES, *MASKING, *GATHERING, *TRACING, *TRACED, *REFERENCE)


def color_target(view: str, settings: Settings, facts: Facts) -> str:
    """The linear picture of a view, simplified to what the scene calls for: hybrid without rays is post, post without
    blur is sharp.
    """
    if view == "hybrid":
        return "hybrid" if partly_occluded(settings, facts).runs else color_target("post", settings, facts)
    if view == "post":
        return "post" if blurred(settings, facts).runs else "lit"
    return {"sharp": "lit", "traced": "traced", "reference": "reference"}[view]


@lru_cache(maxsize=16)  # asked for each frame: by whoever foresees it, and by whoever draws it
def frame_plan(view: str, settings: Settings, facts: Facts) -> FramePlan:
    """The plan that ends in the `display` target for a view or for any target's name. Raises UserError for an unknown
    view.
    """
    if view not in VIEWS:
        return target_plan(view, settings, facts)
    color = color_target(view, settings, facts)
    tail = (
        (resolve_pass(color), display_pass("resolved", settings, facts))
        if settings.temporal.antialias and view not in CONVERGING
        else (display_pass(color, settings, facts),)
    )
    return plan((*PASSES, *tail), "display", settings, facts)


def check_view(view: str) -> None:
    """Raise UserError unless there is such a view or target, in some scene."""
    if view not in VIEWS and view not in VIEWABLE:
        names = ", ".join((*VIEWS, *VIEWABLE))
        raise UserError(f"--view {view}: there is no such view or target; choose one of {names}")


def target_plan(target: str, settings: Settings, facts: Facts) -> FramePlan:
    """The plan that paints one intermediate target."""
    check_view(target)
    if forced := target in OF_MOTION and not facts.moved:
        facts = replace(facts, camera_moved=True)  # zeros are worth seeing, too
    plan(PASSES, target, settings, facts)  # raises, with the reason, where this scene does not call for the target
    frame = plan((*PASSES, show_pass(TARGETS[target])), "display", settings, facts)
    return _asked_for(frame) if forced else frame


def _asked_for(frame: FramePlan) -> FramePlan:
    """The same with the true reason for passes that otherwise wait for something to move."""
    calls = (replace(c, reason=ASKED_FOR) if c.step.name in OF_MOTION else c for c in frame.calls)
    return replace(frame, calls=tuple(calls))


def linear_target(frame: FramePlan) -> str:
    """The target that holds the linear picture of a plan (what an .exr stores)."""
    return next(
        target
        for call in reversed(frame.calls)
        if call.step.name in ("display", "show")
        for name, target in call.reads
        if name == "color"
    )


def read_after(frame: FramePlan) -> frozenset[str]:
    """The targets of a plan that may be read once it was drawn: its pictures, and the depth under a click."""
    return frozenset({frame.output, linear_target(frame), PICKED})
