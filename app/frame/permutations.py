"""Which programs the next step can ask for: every view and motion under the lens as it may become, every setting beside
its present value, every target as a view. Pure: no GL.

A plan depends on camera and lens through two circles of confusion and no more, and through those only by which side of
a threshold they lie on. One pair for each such class therefore stands for all cameras, apertures and focus distances,
and the list does not grow while one flies. A pinhole is in the class without blur, and no further from the others. Of
the surfaces in view, only the G-buffer's program asks.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import Field, replace
from enum import Enum
from itertools import pairwise, product
from typing import Any

from ..errors import UserError
from ..optics import IN_FOCUS_COC_PX
from ..scene.facts import Facts
from ..settings import Settings, opened, put, walk
from .mask import RAYS_BEGIN_PX
from .pipeline import LENS_RAYS, VIEWS, frame_plan
from .post import FULL_RES_PX
from .records import Call
from .targets import TARGETS

_ENDS_PX = sorted({IN_FOCUS_COC_PX, FULL_RES_PX, RAYS_BEGIN_PX})  # where plans change, upwards
_CLASSES_PX = (0.0, *(0.5 * (low + high) for low, high in pairwise(_ENDS_PX)), 2.0 * _ENDS_PX[-1])
LENSES = tuple(product(_CLASSES_PX, repeat=2))  # (near, far) CoC radius in px: one pair of each class
FEWEST_BLADES = 3  # of a polygon: the first count that is no circle


def within_one_step(view: str, settings: Settings, facts: Facts) -> Iterator[Call]:
    """Every call that some plan makes which is one step away from this view, these settings and this scene: another
    view, another lens or camera, one setting changed (`beside`), a target looked at. Calls come again and again, those
    of the likeliest steps first.
    """
    for other in dict.fromkeys((view, *VIEWS)):
        for changed in _may_become(facts, other):
            yield from _calls(other, opened(settings), changed)
    for path, leaf, value in walk(settings):
        for neighbour in beside(leaf, value):
            for changed in _moving(facts, view):
                yield from _calls(view, put(settings, path, neighbour), changed)
    for target in TARGETS:
        for changed in _moving(facts, target):
            yield from _calls(target, settings, changed)


def of_its_class(settings: Settings, facts: Facts) -> tuple[Settings, Facts]:
    """Settings and facts that plan the same, and are equal wherever camera and lens are in the same class, and numbers
    that vary continuously between the same ends.
    """
    for path, leaf, value in walk(settings):
        if isinstance(value, float):
            settings = put(settings, path, _of_its_class(leaf, value))
        elif isinstance(value, tuple):
            settings = put(settings, path, leaf.default)
    near_px, far_px = (_CLASSES_PX[bisect_left(_ENDS_PX, px)] for px in (facts.near_coc_px, facts.far_coc_px))
    return settings, replace(facts, near_coc_px=near_px, far_coc_px=far_px)


def _of_its_class(leaf: Field[Any], value: float) -> float:
    """An end of the range, the default, or for all others one of them."""
    low, high = leaf.metadata["low"], leaf.metadata["high"]
    between = (low + (high if leaf.default == low else leaf.default)) / 2.0
    return value if value in (low, high, leaf.default) else between


def beside(leaf: Field[Any], value: Any) -> tuple[Any, ...]:
    """The values of a setting that count as one step from `value`: the other states of a switch, a choice's other
    members, a number's next ones up and down; of what varies continuously both ends and the default, where alone plans
    may differ; and whatever is the default, to which a click goes back.
    """
    about = leaf.metadata
    if isinstance(value, bool):
        return (not value,)
    if isinstance(value, Enum):
        return tuple(member for member in type(value) if member is not value)
    if isinstance(value, int):
        near = (value - 1, value + 1, FEWEST_BLADES if leaf.name == "blades" else value, leaf.default)
        return tuple(n for n in dict.fromkeys(near) if n != value and about["low"] <= n <= about["high"])
    if isinstance(value, float):
        return tuple(n for n in (about["low"], about["high"], leaf.default) if n != value)
    return ()  # a colour: a uniform, whatever it is


def _may_become(facts: Facts, view: str) -> Iterator[Facts]:
    """The facts of any camera and lens in this scene, still or moving."""
    yield from _moving(facts, view)
    for near_px, far_px in LENSES:
        yield from _moving(replace(facts, near_coc_px=near_px, far_coc_px=far_px), view)
    for mapped, masked in product(range(1 + facts.normal_mapped), range(1 + facts.alpha_masked)):
        seen = replace(facts, normal_mapped_in_view=bool(mapped), alpha_masked_in_view=bool(masked))
        yield from _moving(seen, view)


def _moving(facts: Facts, view: str) -> Iterator[Facts]:
    """Standing still, and a camera that moves: of a plan it is the same whether that or an object does. Where lens rays
    are shown, each with and without pixels that lack their first.
    """
    for moved, unsampled in product((False, True), (False, True) if view in LENS_RAYS else (False,)):
        yield replace(facts, camera_moved=moved, objects_moved=False, unsampled=unsampled)


def _calls(view: str, settings: Settings, facts: Facts) -> tuple[Call, ...]:
    try:
        return frame_plan(view, settings, facts).parts
    except UserError:  # a target that nothing writes here
        return ()
