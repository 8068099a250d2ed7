"""Cases made by hand: what somebody who wants to break a loader would think of, and what exporters got wrong."""

from __future__ import annotations

from . import hostile_animation, hostile_gltf, hostile_images, hostile_others
from .cases import Case

HOSTILE: dict[str, Case] = {
    **hostile_gltf.CASES,
    **hostile_images.CASES,
    **hostile_animation.CASES,
    **hostile_others.CASES,
}
