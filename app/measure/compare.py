"""Two benchmarks side by side: what became faster or slower beyond its noise, and whose errors changed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from .bench import ALL_REGIONS, METRICS, times_of_values
from .bench_report import error_text, number, table, time_text
from .metrics import WHOLE

Values = dict[str, Any]

HEADER = ("scene", "view", "ms in A", "ms in B", "B / A", "time", "errors")


def compared(a: Values, b: Values) -> str:
    """A table of what both hold, below a sentence for each way in which they are not comparable."""
    pairs = [
        (scene["name"], run, other)
        for scene, others in _matched(a["scenes"], b["scenes"], "name")
        for run, other in _matched(scene["runs"], others["runs"], "label")
    ]
    rows = [
        [
            scene,
            run["label"],
            time_text(run["times"]["frame"]),
            time_text(other["times"]["frame"]),
            *time_verdict(run["times"], other["times"]),
            errors_verdict(run, other),
        ]
        for scene, run, other in pairs
    ]
    verdicts = [row[5] for row in rows]
    counts = ", ".join(f"{verdicts.count(v)} {v}" for v in dict.fromkeys(verdicts))
    equal = sum(row[6] == EQUAL for row in rows)
    return "\n".join(
        [
            *(f"Note: {sentence}" for sentence in _warnings(a, b)),
            *(table(HEADER, rows) if rows else ["A and B hold no scene with a candidate in common."]),
            *([f"B beside A: {counts}; errors equal in {equal} of {len(rows)}."] if rows else []),
        ]
    )


FASTER, SLOWER, SAME, TOO_FEW = "faster", "slower", "no difference", "too few frames"
EQUAL = "equal"


def time_verdict(a: Values, b: Values) -> tuple[str, str]:
    """(ratio of the medians, whether B differs from A by more than the noise of both explains)."""
    first, second = (times_of_values(times["frame"]) for times in (a, b))
    ratio = number(second.median / first.median if first.median else math.nan, ".2f")
    if math.isnan(first.low) or math.isnan(second.low):
        return ratio, TOO_FEW
    if not second.differs_from(first):
        return ratio, SAME
    return ratio, FASTER if second.median < first.median else SLOWER


def errors_verdict(a: Values, b: Values) -> str:
    """Whether every error after as many frames is the same; where not, how the one of the whole picture changed."""
    common = sorted(a["errors"].keys() & b["errors"].keys(), key=int)
    if not common:
        return "after other frames"
    differing = [
        (frames, region, metric)
        for frames in common
        for region in ALL_REGIONS
        for metric in METRICS
        if a["errors"][frames][region][metric] != b["errors"][frames][region][metric]
    ]
    if not differing:
        return EQUAL if a["errors"].keys() == b["errors"].keys() else f"{EQUAL} as far as both go"
    metrics = {metric for *_, metric in differing}
    metric = "flip" if "flip" in metrics and _known(a, b, common[-1], "flip") else "rmse"
    before, after = (error_text(run, int(common[-1]), metric, WHOLE) for run in (a, b))
    return f"changed: {metric.replace('flip', 'FLIP').replace('rmse', 'RMSE')} {before} to {after}"


def _known(a: Values, b: Values, frames: str, metric: str) -> bool:
    return all(run["errors"][frames][WHOLE][metric] is not None for run in (a, b))


def _warnings(a: Values, b: Values) -> Iterator[str]:
    for key, what in (("device", "devices"), ("size", "sizes"), ("seed", "seeds"), ("spp", "references")):
        if a[key] != b[key]:
            first, second = (_shown(values[key]) for values in (a, b))
            yield f"the {what} differ, {first} in A and {second} in B: {_MEANS[key]}."
    for sources in ({(run["times"]["frame_source"]) for s in r["scenes"] for run in s["runs"]} for r in (a, b)):
        if len(sources) > 1:
            yield "the frames of one result were timed in several ways."
    names = [{scene["name"] for scene in result["scenes"]} for result in (a, b)]
    for which, only in (("A", names[0] - names[1]), ("B", names[1] - names[0])):
        if only:
            yield f"only {which} has {', '.join(sorted(only))}."
    for scene, other in _matched(a["scenes"], b["scenes"], "name"):
        parts = [part for part in ("digest", "camera", "settings") if scene[part] != other[part]]
        if parts:
            said = ", ".join(part.replace("digest", "content") for part in parts)
            yield f"{scene['name']} is not the same in both ({said}): neither errors nor times compare."
        labels = [{run["label"] for run in s["runs"]} for s in (scene, other)]
        for which, only in (("A", labels[0] - labels[1]), ("B", labels[1] - labels[0])):
            if only:
                yield f"of {scene['name']} only {which} has {'; '.join(sorted(only))}."


_MEANS = {
    "device": "the times compare two machines",
    "size": "neither errors nor times compare",
    "seed": "errors differ by noise",
    "spp": "errors differ by the noise of the references",
}


def _matched(a: list[Values], b: list[Values], key: str) -> Iterator[tuple[Values, Values]]:
    others = {value[key]: value for value in b}
    return ((value, others[value[key]]) for value in a if value[key] in others)


def _shown(value: Any) -> str:
    return "x".join(map(str, value)) if isinstance(value, list) else str(value)
