"""Every function of glsl/lib against its float64 twin, over the edge values of all its arguments at once.

The functions are found in the files, so that a new one without a twin and a case fails here by its name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import moderngl
import numpy as np
import pytest

from app import optics, sampling, tone
from app.bvh import oracle
from app.gpu import octahedral
from app.gpu.shaders import load_glsl
from app.measure import metrics
from app.panel import colormap

from . import (
    hybrid_twin,
    library_hybrid,
    library_lens,
    library_post,
    library_shading,
    library_twin,
    post_twin,
    shading_twin,
)
from .edges import Case, table, wrong
from .harness import call_glsl

#: Tested beside its own kind: rays and boxes are no values of one column each.
ELSEWHERE = {"intersect": Path(__file__).with_name("test_intersect.py")}
CASES: Mapping[str, Mapping[str, Case]] = {
    **library_shading.CASES,
    **library_post.CASES,
    **library_hybrid.CASES,
    **library_lens.CASES,
}
TWINS: tuple[ModuleType, ...] = (
    *(optics, sampling, tone, octahedral, colormap, metrics, oracle),
    *(post_twin, hybrid_twin, shading_twin, library_twin),
)
_FUNCTION = re.compile(r"^\w+ (\w+)\(", re.MULTILINE)


def functions(file: str) -> list[str]:
    """The names that a file of glsl/lib defines as functions."""
    text = re.sub(r"//[^\n]*", "", load_glsl()[f"lib/{file}.glsl"])
    return [name for name in dict.fromkeys(_FUNCTION.findall(text)) if name != "main"]


FILES = {name[4:-5]: None for name in sorted(load_glsl()) if name.startswith("lib/")}
LIBRARY = [(file, name) for file in FILES for name in functions(file) if file not in ELSEWHERE]


@pytest.mark.parametrize(("file", "name"), LIBRARY)
def test_every_function_has_a_twin_of_its_name_and_a_case(file: str, name: str) -> None:
    assert any(callable(getattr(module, name, None)) for module in TWINS), f"{name} has no float64 twin"
    case = CASES.get(file, {}).get(name)
    assert case is not None, f"{name} of lib/{file}.glsl is compared with nothing"
    assert re.search(rf"\b{name}\(", case.signature + case.extra), f"the case of {name} does not call it"


def test_no_case_outlives_its_function() -> None:
    assert {(file, name) for file, cases in CASES.items() for name in cases} == set(LIBRARY)


def test_what_is_tested_elsewhere_is() -> None:
    for file, path in ELSEWHERE.items():
        assert f"lib/{file}.glsl" in path.read_text()


@pytest.mark.parametrize(("file", "name"), LIBRARY)
def test_functions_are_their_twins_over_all_edge_values(ctx: moderngl.Context, file: str, name: str) -> None:
    case = CASES[file][name]
    rows = table(*case.arguments)
    got = call_glsl(ctx, f"lib/{file}.glsl", case.signature, *rows, extra=case.extra)
    bad = np.flatnonzero(wrong(case, rows, got))
    with np.errstate(all="ignore"):
        told = [
            f"{name}({', '.join(str(r[i]) for r in rows)}) is {got[i]}, not {case.twin(*(r[i : i + 1] for r in rows))}"
            for i in bad[:5]
        ]
    assert not len(bad), f"{len(bad)} of {len(got)} rows:\n" + "\n".join(told)
