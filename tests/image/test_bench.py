"""A small benchmark from beginning to end: stopped midway it says so and goes on, and errors repeat exactly."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from app.cli import main
from app.interrupts import INTERRUPTED
from app.measure.bench_store import read_results

ROOT = Path(__file__).parents[2]
RUNS = ("post, 4 rings", "hybrid, 2 rays", "traced, 1 spp", "traced, 2 spp")
OPTIONS = (
    *("--size", "96x54", "--frames", "2", "--timed", "6", "--spp", "8", "--lens.aperture", "0.1"),
    *("--views", "post,hybrid,traced", "--rings", "4", "--rays", "2", "--samples", "1,2", "--seed", "3"),
)


def started(folder: Path, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "app", "bench", "toy-train", "-o", str(folder), *OPTIONS, *more]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def errors(folder: Path) -> dict[str, Any]:
    (scene,) = read_results(folder)["scenes"]
    return {run["label"]: run["errors"] for run in scene["runs"]}


def test_a_benchmark_is_stopped_goes_on_and_repeats(tmp_path: Path, capsys: Any) -> None:
    stopped, whole = tmp_path / "stopped", tmp_path / "whole"
    first = started(stopped)
    assert first.stderr
    said = []
    for line in iter(first.stderr.readline, ""):
        said.append(line)
        if "toy-train, post, 4 rings" in line:
            first.send_signal(signal.SIGINT)
            break
    said += first.stderr.readlines()
    assert first.wait(60) == INTERRUPTED, said
    assert said[-1] == "hybrid-dof: interrupted\n"
    assert not any("Traceback" in line for line in said)
    kept = stopped / "runs" / "toy-train" / "post-4-rings.json"
    before = kept.read_bytes()
    assert not (stopped / "bench.json").exists()

    second, other = started(stopped), started(whole, "--fresh")
    for process in (second, other):
        out, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
        assert "bench.md" in out
    assert kept.read_bytes() == before, "what was done is not done again"
    assert errors(stopped) == errors(whole)
    assert tuple(errors(whole)) == RUNS

    (scene,) = read_results(whole)["scenes"]
    post = scene["runs"][0]
    assert (post["times"]["frame"]["count"], post["times"]["warm_up"]) == (6, 2)
    assert post["times"]["frame"]["low"] <= post["times"]["frame"]["median"] <= post["times"]["frame"]["high"]
    assert {"gbuffer", "gather", "post"} <= post["times"]["passes"].keys()
    traced = {run["label"]: run["errors"] for run in scene["runs"]}
    assert traced["traced, 1 spp"]["2"] == traced["traced, 2 spp"]["1"]
    assert traced["traced, 2 spp"]["2"]["whole"]["rmse"] < traced["traced, 1 spp"]["1"]["whole"]["rmse"]
    assert scene["settings"]["lens.aperture"] == 0.1
    assert all((whole / name).stat().st_size for name in ("bench.csv", "bench.md"))

    assert main(["bench", "--compare", str(stopped), str(whole)]) == 0
    assert capsys.readouterr().out.endswith("errors equal in 4 of 4.\n")
    assert json.loads((whole / "runs" / "configuration.json").read_text())["settings"] == {"lens.aperture": 0.1}
