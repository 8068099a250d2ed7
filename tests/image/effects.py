"""Costs follow content: `python -m tests.image.effects [-o FILE.md]`.

Two tables. What each pass of the hybrid takes in one frame, and what leaving it out saves, over scenes and lenses that
call for more and for less. And frames that should cost the same, or less, against each other, as ratios.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import moderngl

from app.camera import Moment
from app.frame.records import FramePlan
from app.gpu.context import device_name, headless_context
from app.measure.savings import Costs, PassCost, measuring
from app.measure.steps import driven

from .effects_cases import CASES, PAIRS, Pair, Side, stage_for
from .fair_time import Shot, clock_name, ratio
from .markdown import NOTHING, table
from .options import check_outputs, report, size

Size = tuple[int, int]


def columns(ctx: moderngl.Context, size: Size) -> Iterator[tuple[str, Costs]]:
    """Name and costs of each case that can be drawn here."""
    for case in CASES:
        if stage := stage_for(ctx, case.subject):
            stage.renderer.resize(size)
            moment = Moment(stage.camera, 0.0)
            yield case.name, driven(measuring(ctx, stage.renderer, "hybrid", moment, case.change(stage)))


def pass_table(costs: dict[str, Costs]) -> str:
    """A row per pass: ms where it ran, in brackets what it would have taken where it was left out."""
    found = {name: {cost.name: cost for cost in of.passes} for name, of in costs.items()}
    rows = []
    for name in dict.fromkeys(cost.name for of in costs.values() for cost in of.passes):
        cells = [found[case].get(name) for case in costs]
        if any(cell and cell.full_ms is not None for cell in cells):
            rows.append([name, *(_cell(cell) for cell in cells)])
    rows.append(["**frame**", *(f"**{of.ms:.0f}**" for of in costs.values())])
    rows.append(["with every effect", *(f"{of.full_ms:.0f}" for of in costs.values())])
    return table(["ms", *costs], rows)


def _cell(cost: PassCost | None) -> str:
    if cost is None or (cost.ms is None and cost.full_ms is None):
        return NOTHING
    return f"({cost.full_ms:.1f})" if cost.ms is None else f"{cost.ms:.1f}"


def pair_row(ctx: moderngl.Context, pair: Pair, size: Size) -> list[str] | None:
    """The ratio of a pair, and why it is what it is; None where its scene is missing."""
    shots = [_shot(ctx, side, size) for side in (pair.first, pair.second)]
    first, second = shots
    if first is None or second is None:
        return None
    told, found = _compared(*(_plan_and_rays(shot) for shot in (first, second))), ratio(ctx, first, second)
    return [pair.name, f"{found:.2f}{'' if found <= pair.most else ' (missed)'}", f"{pair.most:.2f}", told]


def _shot(ctx: moderngl.Context, side: Side, size: Size) -> Shot | None:
    stage = stage_for(ctx, side.subject)
    if stage is None:
        return None
    stage.renderer.resize(size)
    return Shot(stage, side.view, side.change(stage))


def _plan_and_rays(shot: Shot) -> tuple[FramePlan, int]:
    renderer = shot.stage.draw(shot.view, shot.stage.renderer.size, frames=4, settings=shot.settings)
    assert renderer.plan is not None
    traces = any(call.step.name == "trace" for call in renderer.plan.calls)
    return renderer.plan, int(renderer.read("ray_count")[..., 0].sum()) if traces else 0


def _compared(first: tuple[FramePlan, int], second: tuple[FramePlan, int]) -> str:
    if second[1]:
        return f"{first[1]} rays of {second[1]}, {100.0 * first[1] / second[1]:.1f} %"
    names = [[call.program for call in plan.parts] for plan, _ in (first, second)]
    if names[0] == names[1]:
        return "the same programs"
    counts = [len(n) for n in names]
    return "leaner programs" if counts[0] == counts[1] else f"{counts[0]} programs instead of {counts[1]}"


def main(arguments: list[str]) -> None:
    """Measure, print, and write where asked."""
    options = argparse.ArgumentParser(prog="python -m tests.image.effects", description=__doc__)
    options.add_argument("--size", type=size, default=(640, 360), help="of the pictures (default: 640x360)")
    options.add_argument("-o", dest="output", type=Path, metavar="FILE.md", help="write the tables there, too")
    given = options.parse_args(arguments)
    check_outputs(options, given.output)
    ctx = headless_context()
    rows = [row for pair in PAIRS if (row := pair_row(ctx, pair, given.size))]
    costs = dict(columns(ctx, given.size))
    example = stage_for(ctx, "still-life")
    assert example is not None
    clock = clock_name(ctx, Shot(example, "sharp", example.settings))
    report(
        f"{device_name(ctx)}, {given.size[0]}x{given.size[1]}.\n\nFrames in turn, by {clock}:\n\n"
        + table(["frames", "ratio", "at most", "what is compared"], rows)
        + f"\n\nPasses, ms by {example.renderer.profiler.source}:\n\n"
        + pass_table(costs),
        given.output,
    )


if __name__ == "__main__":
    main(sys.argv[1:])
