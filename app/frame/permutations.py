"""Which programs the next step can ask for: every view and motion under the lens as it may become, every setting beside
its present value, every target as a view. Pure: no GL.

A plan depends on camera and lens through two circles of confusion and no more, and through those only by which side of
a threshold they lie on. One pair for each such class therefore stands for all cameras, apertures and focus distances,
and the list does not grow while one flies. Of the surfaces in view, only the G-buffer's program asks.
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
from ..settings import Settings, put, walk
from .hybrid import RAYS_BEGIN_PX
from .pipeline import VIEWS, frame_plan
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
    for other, changed in product(dict.fromkeys((view, *VIEWS)), _may_become(facts)):
        yield from _calls(other, settings, changed)
    for path, leaf, value in walk(settings):
        for neighbour in beside(leaf, value):
            for changed in _moving(facts):
                yield from _calls(view, put(settings, path, neighbour), changed)
    for target, changed in product(TARGETS, _moving(facts)):
        yield from _calls(target, settings, changed)


def of_its_class(facts: Facts) -> Facts:
    """Facts that plan the same, and are equal wherever camera and lens are in the same class."""
    near_px, far_px = (_CLASSES_PX[bisect_left(_ENDS_PX, px)] for px in (facts.near_coc_px, facts.far_coc_px))
    return replace(facts, near_coc_px=near_px, far_coc_px=far_px)


def beside(leaf: Field[Any], value: Any) -> tuple[Any, ...]:
    """The values of a setting that count as one step from `value`: the other states of a switch, a choice's other
    members, a number's next ones up and down; of what varies continuously both ends, where alone plans may differ.
    """
    about = leaf.metadata
    if isinstance(value, bool):
        return (not value,)
    if isinstance(value, Enum):
        return tuple(member for member in type(value) if member is not value)
    if isinstance(value, int):
        near = (value - 1, value + 1, FEWEST_BLADES if leaf.name == "blades" else value)
        return tuple(n for n in near if n != value and about["low"] <= n <= about["high"])
    if isinstance(value, float):
        return tuple(end for end in (about["low"], about["high"]) if end != value)
    return ()  # a colour: a uniform, whatever it is


def _may_become(facts: Facts) -> Iterator[Facts]:
    """The facts of any camera and lens in this scene, still or moving."""
    yield from _moving(facts)
    for near_px, far_px in LENSES:
        yield from _moving(replace(facts, near_coc_px=near_px, far_coc_px=far_px))
    for mapped, masked in product(range(1 + facts.normal_mapped), range(1 + facts.alpha_masked)):
        yield from _moving(replace(facts, normal_mapped_in_view=bool(mapped), alpha_masked_in_view=bool(masked)))


def _moving(facts: Facts) -> Iterator[Facts]:
    """Standing still, and a camera that moves: of a plan it is the same whether that or an object does. Each with and
    without pixels that lack their first sample.
    """
    for moved, unsampled in product((False, True), repeat=2):
        yield replace(facts, camera_moved=moved, objects_moved=False, unsampled=unsampled)


def _calls(view: str, settings: Settings, facts: Facts) -> tuple[Call, ...]:
    try:
        return frame_plan(view, settings, facts).parts
    except UserError:  # a target that nothing writes here
        return ()
