"""A benchmark's results as files to read: bench.json holds everything, bench.csv and bench.md the figures."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..files import write_text
from ..picture import write_json
from ..settings import Settings
from .bench import ALL_REGIONS, METRICS, error, last_frames, metric_of, post_of
from .candidates import front
from .metrics import WHOLE
from .regions import REGIONS

Values = dict[str, Any]

NOTHING = "–"  # what was not measured, or does not exist
NEAR = "near_silhouettes"
NAMES = {"flip": "FLIP", "rmse": "RMSE"}


def write_report(results: Values, folder: Path) -> list[Path]:
    """bench.json, bench.csv and bench.md."""
    files = [folder / f"bench.{kind}" for kind in ("json", "csv", "md")]
    write_json(files[0], results)
    for path, text in ((files[1], csv_text(results)), (files[2], markdown(results))):
        write_text(path, text)
    return files


def on_fronts(scene: Values, frames: int, region: str = WHOLE) -> tuple[set[str], set[str]]:
    """Labels of what no other candidate beats in both time and error, after one frame and after `frames`."""
    runs, metric = scene["runs"], metric_of(scene["runs"])
    first, last = (
        {runs[i]["label"] for i in front([(median_ms(run), error(run, after, metric, region)) for run in runs])}
        for after in (1, frames)
    )
    return first, last


def median_ms(run: Values) -> float:
    """Of a frame."""
    return _number(run["times"]["frame"]["median"])


# -- CSV ---------------------------------------------------------------------------------------------------------------


def csv_text(results: Values) -> str:
    """A row for each scene, candidate and region."""
    rows = [row for scene in results["scenes"] for row in _csv_rows(results, scene)]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _csv_rows(results: Values, scene: Values) -> Iterator[Values]:
    for run in scene["runs"]:
        times, last = run["times"], last_frames(run)
        setting, value = next(iter(run["varied"].items()), ("", ""))
        for region in ALL_REGIONS:
            fronts = on_fronts(scene, results["frames"], region)
            yield {
                "scene": scene["name"],
                "candidate": run["label"],
                "view": run["view"],
                "setting": setting,
                "value": value,
                "region": region,
                "share_of_pixels": scene["share"][region],
                **_csv_errors(run, 1, region, "first"),
                "frames_last": last,
                **_csv_errors(run, last, region, "last"),
                "on_front_first": int(run["label"] in fronts[0]),
                "on_front_last": int(run["label"] in fronts[1]),
                "ms_median": times["frame"]["median"],
                "ms_low": times["frame"]["low"],
                "ms_high": times["frame"]["high"],
                "ms_p95": times["frame"]["p95"],
                "cpu_ms_median": times["cpu"]["median"],
                "frames_timed": times["frames"],
                "warm_up": times["warm_up"],
                "timing_source": times["frame_source"],
                "floor_rmse": scene["floor"][region]["rmse"],
                "floor_flip": scene["floor"][region]["flip"],
                "reference_spp": results["spp"],
                "width": results["size"][0],
                "height": results["size"][1],
                "seed": results["seed"],
                "device": results["device"],
            }


def _csv_errors(run: Values, frames: int, region: str, suffix: str) -> Values:
    errors = run["errors"][str(frames)][region]
    return {
        **{f"{metric}_{suffix}": errors[metric] for metric in METRICS},
        f"at_floor_{suffix}": " ".join(errors["at_floor"]),
    }


# -- Markdown ----------------------------------------------------------------------------------------------------------


def markdown(results: Values) -> str:
    """A table for each scene, and what one must know to read it."""
    width, height = results["size"]
    sources = sorted({run["times"]["frame_source"] for scene in results["scenes"] for run in scene["runs"]})
    frames = results["frames"]
    lines = [
        "# Accuracy against time",
        "",
        f"{width}x{height} pixels on {results['device']}; Python {results['python']}, "
        + ", ".join(f"{name} {number}" for name, number in results["packages"].items() if number)
        + f"; seed {results['seed']}.",
        "",
        f"`{results['command']}`",
        "",
        f"* Errors are against a rasterised reference of {results['spp']} lens points, after the first frame and after "
        f"{frames}; 0 is identical. None is quoted below the reference's own noise: that is *at the floor*. "
        "*Near silhouettes*: the pixels that see both sides of something in front of the focus zone.",
        f"* ms: median of a frame ({'; '.join(sources)}) and the interval that holds it with 95 % confidence, which "
        f"takes at least 6 frames; n frames were timed. CPU: the drawing thread's own time.",
        "* Front: no other row is both faster and more accurate over the whole picture, "
        f"after the first frame (1) or after {frames} ({frames}).",
        "* Traced: its samples form one mean, of at most 64 here; where fewer frames fit, their number is in brackets.",
    ]
    for scene in results["scenes"]:
        lines += ["", f"## {scene['name']}", "", *_scene_lines(results, scene)]
    return "\n".join(lines) + "\n"


def _scene_lines(results: Values, scene: Values) -> list[str]:
    frames, runs = results["frames"], scene["runs"]
    metric, post = metric_of(runs), post_of(runs, Settings().post.rings)
    name, fronts = NAMES[metric], on_fronts(scene, frames)
    after = f"{frames} frames"
    errors = [
        (f"{name}, 1 frame", 1, metric, WHOLE),
        (f"{name}, {after}", frames, metric, WHOLE),
        (f"{name} near silhouettes, 1 frame", 1, metric, NEAR),
        (f"{name} near silhouettes, {after}", frames, metric, NEAR),
        (f"RMSE, {after}", frames, "rmse", WHOLE),
        (f"RMSE near silhouettes, {after}", frames, "rmse", NEAR),
    ][: 6 if metric == "flip" else 4]
    ratios = ["ms / post", f"{name} / post, {after}"] if post else []
    header = ["view", *(title for title, *_ in errors), "ms", "p95", "n", "CPU ms", *ratios, "front"]
    rows = [
        [
            run["label"],
            *(error_text(run, *which) for _, *which in errors),
            time_text(run["times"]["frame"]),
            ms_text(run["times"]["frame"]["p95"]),
            str(run["times"]["frame"]["count"]),
            ms_text(run["times"]["cpu"]["median"]),
            *(_ratios(run, post, frames, metric) if post else []),
            ", ".join(str(n) for n, labels in zip((1, frames), fronts) if run["label"] in labels),
        ]
        for run in runs
    ]
    lens, floor, share = scene["settings"], scene["floor"], scene["share"]
    return [
        f"Aperture {lens['lens.aperture']:g} m, focus {lens['lens.focus_distance']:g} m, "
        f"shading {lens['shading.mode']}. Floor: {name} {number(floor[WHOLE][metric], '.2g')}, near silhouettes "
        f"{number(floor[NEAR][metric], '.2g')}. Pixels: "
        + ", ".join(f"{share[region]:.0%} {region.replace('_', ' ')}" for region in REGIONS)
        + (f". Ratios to {post['label']}." if post else "."),
        "",
        *table(header, rows),
    ]


def _ratios(run: Values, post: Values, frames: int, metric: str) -> list[str]:
    after = min(frames, last_frames(run))
    errors = error(run, after, metric), error(post, frames, metric)
    return [_ratio(median_ms(run), median_ms(post)), _ratio(*errors) + (f" ({after})" if after < frames else "")]


def error_text(run: Values, frames: int, metric: str, region: str) -> str:
    """An error as it may be quoted; in brackets the frames, where they are fewer than asked for."""
    after = min(frames, last_frames(run))
    errors = run["errors"][str(after)][region]
    text = number(errors[metric], ".3g")
    if metric in errors["at_floor"]:
        text = f"at the floor (<{text})"
    return text if after == frames else f"{text} ({after})"


def time_text(times: Values) -> str:
    """A median and its interval."""
    median = ms_text(times["median"])
    return median if times["low"] is None else f"{median} [{ms_text(times['low'])}, {ms_text(times['high'])}]"


def ms_text(ms: float | None) -> str:
    """Milliseconds with three digits that count, or all in front of the point."""
    return number(ms, ".0f" if ms is not None and ms >= 1000.0 else "#.3g").removesuffix(".")


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """The lines of a Markdown table, in columns that are also read without a viewer."""
    widths = [max(len(row[i]) for row in (header, *rows)) for i in range(len(header))]
    lines = [header, ["-" * width for width in widths], *rows]
    return ["| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths)) + " |" for line in lines]


def number(value: float | None, form: str) -> str:
    """A number in a format such as ".3g"; what is not known is NOTHING."""
    return NOTHING if value is None or not math.isfinite(value) else format(value, form)


def _ratio(value: float, base: float) -> str:
    return number(value / base if base else math.nan, ".2f")


def _number(value: float | None) -> float:
    return math.nan if value is None else value
