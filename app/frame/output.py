"""Stage 3 and 10: temporal anti-aliasing, tone mapping, and the target viewer.

Anti-aliasing comes last, on the finished picture of whichever view: every frame is a consistent picture of its own
sample position, and their mean converges to the box-filtered pixel that the traced view computes. Averaging the sharp
image and its CoC first, as a design with the anti-aliasing up front would, gives silhouettes a CoC that is neither the
near surface's nor the far one's.
"""

from __future__ import annotations

from ..scene.facts import Facts
from ..settings import Settings, ToneMap
from .records import Defines, Pass, Target

SHOW_KINDS = ("color", "signed", "scalar", "normal", "vector")


def tone_defines(settings: Settings, facts: Facts) -> Defines:
    """Tone curve and overlay, compiled in."""
    return (
        ("TONE_MAP", list(ToneMap).index(settings.shading.tone_map)),
        ("FOCUS_PLANE", int(settings.overlay.focus_plane)),
        ("BACKDROP", int(facts.unsampled)),
    )


def resolve_pass(color: str) -> Pass:
    """Accumulate the view's picture over frames."""
    return Pass(
        "resolve",
        "output/resolve.comp",
        reads=(f"color={color}",),
        optional=("motion",),
        history=("resolved",),
        writes=("resolved",),
        in_place_without=(("resolved", "motion"),),
        defines=lambda s, f: (("LAYERED", int(color == "hybrid")),),
    )


def display_pass(color: str, settings: Settings, facts: Facts) -> Pass:
    """Radiance to display values. The focus-plane overlay needs the CoC; a running mean in its first sample needs
    something to show.
    """
    reads = (f"color={color}",) + ("coc",) * settings.overlay.focus_plane + ("backdrop=lit",) * facts.unsampled
    return Pass("display", "output/display.comp", reads=reads, writes=("display",), defines=tone_defines)


def show_pass(target: Target) -> Pass:
    """Paint one target readably."""
    return Pass(
        "show",
        "output/show.comp",
        reads=(f"color={target.name}",),
        writes=("display",),
        defines=lambda s, f: (("SHOW", SHOW_KINDS.index(target.show)),),
    )
