"""From passes to the frame that is wanted: reachability backwards from one target. Pure: no GL, no I/O."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import UserError
from ..scene.facts import Facts
from ..settings import Settings
from .records import Call, FramePlan, Need, Pass, Skipped, split_read


class PlanError(Exception):
    """Passes that contradict each other: a defect of the pipeline, named."""


def plan(passes: Sequence[Pass], output: str, settings: Settings, facts: Facts) -> FramePlan:
    """The calls that produce `output`, in list order, which is checked to be a valid frame order.

    Raises UserError if nothing writes `output` with these settings (with the reason), PlanError for a pass list that
    cannot run.
    """
    needs = {p.name: p.needed(settings, facts) for p in passes}
    producers = {t: p for p in passes if needs[p.name].runs for t in (*p.outputs(settings, facts), *p.offers, *p.fills)}
    if output not in producers:
        raise UserError(
            f"nothing writes the target {output!r} here: {_why_not(passes, output, settings, facts, needs)}"
        )
    live = _reachable(output, producers)
    read = {output, *(t for p in passes if p.name in live for t in (*(split_read(r)[1] for r in p.reads), *p.history))}
    written: set[str] = set()
    calls, skipped = [], []
    for step in passes:
        if step.name not in live:
            reason = "nothing shown reads it" if needs[step.name].runs else needs[step.name].reason
            skipped.append(Skipped(step.name, reason, step.shader))
            continue
        present = tuple(r for r in step.optional if split_read(r)[1] in producers)
        reads = tuple(split_read(r) for r in (*step.reads, *present))
        if missing := {*(t for _, t in reads), *step.takes} - written:
            raise PlanError(f"{step.name} runs before anything wrote {sorted(missing)}")
        writes = (*step.outputs(settings, facts), *(t for t in step.offers if t in read))
        written |= {*writes, *step.fills}
        has = tuple((f"HAS_{split_read(r)[0].upper()}", int(r in present)) for r in step.optional)
        has += tuple((f"HAS_{t.upper()}", int(t in writes)) for t in (*(t for t, _ in step.writes_if), *step.offers))
        defines = tuple(sorted({*step.defines(settings, facts), *has}))
        in_place = tuple(target for target, read in step.in_place_without if read not in present)
        kernels = step.kernels(settings, facts)
        calls.append(Call(step, reads, writes, defines, needs[step.name].reason, in_place, kernels))
    frame = FramePlan(tuple(calls), output, tuple(skipped))
    if missing := {call.step.grid for call in calls if call.step.grid} - frame.targets:
        raise PlanError(f"the size of {sorted(missing)} is asked for, which nothing touches")
    return frame


def _reachable(output: str, producers: dict[str, Pass]) -> set[str]:
    live: set[str] = set()
    wanted = [output]
    while wanted:
        target = wanted.pop()
        if target not in producers:
            raise PlanError(f"something reads {target!r}, which nothing writes")
        step = producers[target]
        if step.name not in live:
            live.add(step.name)
            wanted += [split_read(r)[1] for r in step.reads]
            wanted += [t for t in (split_read(r)[1] for r in step.optional) if t in producers]
            wanted += [t for t in step.history if t in producers]
            wanted += step.takes
    return live


def _why_not(passes: Sequence[Pass], output: str, settings: Settings, facts: Facts, needs: dict[str, Need]) -> str:
    for step in passes:
        if output in (*step.writes, *step.updates, *step.offers):
            return needs[step.name].reason
        if output in {t for t, _ in step.writes_if}:
            need = needs[step.name]
            return "this scene, seen so, calls for none" if need.runs else need.reason
    return "it is no target of this view"
