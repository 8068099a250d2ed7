"""What passes between the window and its user interface.

A frozen value that the interface may replace, facts that it shows, and wishes that it utters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ..camera import Viewpoint
from ..frame.records import FramePlan
from ..gpu.health import BadTexels
from ..measure.metrics import Errors
from ..measure.survey import Findings
from ..scene.model import LoadReport
from ..settings import Settings

Size = tuple[int, int]
Wish = Literal[
    "load",
    "viewpoint",
    "reload",
    "screenshot",
    "fit range",
    "save camera",
    "save preset",
    "load preset",
    "advise",
    "stop advice",
    "measure savings",
]


@dataclass(frozen=True)
class SurveyWish:
    """What accuracy costs: whether anyone wants to know, and how exactly."""

    open: bool = False  # the panel's section: nothing is measured while it is closed
    dear: bool = False  # with the candidates that take longest
    flip: bool = False  # with FLIP
    width: int = 160  # px, of the pictures that are measured


@dataclass(frozen=True)
class Look:
    """What the user asked to see. Keys and panel both replace it; the window draws it."""

    settings: Settings = field(default_factory=Settings)
    view: str = "hybrid"
    other: str = "sharp"  # the right-hand view of the split screen
    compare: bool = False
    bar: float = 0.5  # fraction of the picture's width that shows `view`
    scale: float = 1.0  # picture pixels per window pixel
    panel: bool = True
    help: bool = False
    heat: bool = False  # where the picture is wrong, instead of the picture
    survey: SurveyWish = field(default_factory=SurveyWish)


@dataclass(frozen=True)
class Request:
    """Something only the window can do, uttered by the panel and done between two frames."""

    wish: Wish
    text: str = ""  # a scene's name or path, or a preset's, or what advice is to keep: "error" or "ms"
    number: float = 0.0  # its limit
    viewpoint: Viewpoint | None = None


@dataclass(frozen=True)
class Cost:
    """What one view's frame consisted of and cost."""

    view: str
    plan: FramePlan | None = None
    timings: tuple[tuple[str, float], ...] = ()  # (pass, median ms)
    samples: int = 0
    limit: int = 0  # samples after which a still picture rests
    size: Size = (0, 0)  # px
    health: Mapping[str, BadTexels] = field(default_factory=dict)  # of the targets looked at so far
    before: Mapping[str, float] = field(default_factory=dict)  # ms of passes that ran earlier, by name


@dataclass(frozen=True)
class SurveyShown:
    """What a survey found, and why it waits if it does."""

    findings: Findings
    moving: bool = False  # nothing is measured meanwhile, and what was found is of the picture before
    plays: bool = False  # and it is the scene's motion that does


@dataclass(frozen=True)
class HeatShown:
    """The map of the error over the picture."""

    ready: bool = False
    part: float = 0.0  # of the true picture that is drawn
    ends: tuple[float, float] = (0.0, 1.0)  # of its colours
    errors: Mapping[str, Errors] | None = None  # of the picture on screen, by region
    floor: Mapping[str, Errors] | None = None  # the true picture's noise


@dataclass(frozen=True)
class ProgramsShown:
    """Compiled shaders: what is there, and what the next step can ask for."""

    kept: int
    most: int  # that are kept
    ready: int  # of those within one step
    for_rays: int  # of those within one step, what waits for the scene's tree
    complete: bool  # all but these are ready


@dataclass(frozen=True)
class Shown:
    """What the panel tells but cannot change."""

    device: str = ""
    timing_source: str = ""
    costs: tuple[Cost, ...] = ()  # one, or two in the split screen
    frame_ms: float = 0.0  # wall clock of the last whole frame
    scene: str = ""
    report: LoadReport | None = None
    viewpoints: tuple[Viewpoint, ...] = ()
    memory: Mapping[str, int] = field(default_factory=dict)
    speed: float = 1.0  # m/s
    motion: tuple[bool, float] | None = None  # whether the scene's motion plays, and its time, s; None: nothing moves
    load_error: str = ""
    preset_error: str = ""
    advising: bool = False  # a search for settings is under way
    advice: str = ""  # how far it is, or what came of it
    shader_error: str = ""
    message: str = ""  # fades after a few seconds
    loading: tuple[str, float] | None = None  # stage and fraction
    preparing: tuple[str, float] | None = None  # what the view that was asked for waits for, and the part that is done
    programs: ProgramsShown | None = None
    full_ms: Mapping[str, float] = field(default_factory=dict)  # by pass, with every effect on
    measuring: float | None = None  # the part of that which is done
    survey: SurveyShown | None = None
    heat: HeatShown | None = None
