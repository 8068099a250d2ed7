"""What the panel, the title and the status log tell of the window's parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from ..panel.model import Look, Shown
from .ledger import Ledger
from .stage import Stage
from .state import State
from .surveyor import Surveyor
from .warmup import WarmUp


def telling(state: State, stage: Stage, surveyor: Surveyor, warm_up: WarmUp, ledger: Ledger, now: float) -> Shown:
    """Everything that is shown beside the picture at `now` [s, of time.perf_counter]."""
    survey, heat = surveyor.shown()
    costs, preparing = stage.costs(), stage.preparing
    return replace(
        state.shown,
        timing_source=stage.timing_source,
        costs=costs,
        scene=stage.name,
        report=stage.scene.report if stage.scene else None,
        viewpoints=stage.viewpoints,
        memory=stage.memory | surveyor.memory,
        speed=state.pilot.speed,
        motion=(state.playing, state.time_s) if stage.moves else None,
        message=state.shown.message if now < state.message_until else "",
        survey=survey,
        heat=heat,
        loading=state.shown.loading or (preparing if not costs else None),
        preparing=preparing if costs else None,
        programs=warm_up.shown(),
        full_ms=ledger.full_ms,
        measuring=ledger.part,
    )


def title(look: Look, stage: Stage) -> str:
    """The views, what they wait for, and the scene."""
    name = Path(stage.name).name
    views = f"{look.view} | {look.other}" if look.compare else look.view
    if stage.preparing:
        what, part = stage.preparing
        views += f" ({what.lower()}, {100.0 * part:.0f} %)"
    return f"{views} - {name} - hybrid-dof" if name else "loading - hybrid-dof"


def readiness(stage: Stage, warm_up: WarmUp) -> dict[str, Any]:
    """For the status log: the scene, whether its picture is there and at rest, and what was compiled for it."""
    costs = stage.costs()
    return {
        "scene": stage.name,
        "drawn": bool(costs),
        "resting": not stage.preparing and all(cost.samples >= cost.limit for cost in costs),
        "preparing": stage.preparing,
        "tree": stage.traces,
        "warm": warm_up.done,
        "programs": len(stage.rehearsal.programs),
        "compiled": stage.compiled,
    }
