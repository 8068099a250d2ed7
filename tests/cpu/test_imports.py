"""The dependency direction of the package, read from the syntax tree of every module: nothing imports upwards."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

APP = Path(__file__).parents[2] / "app"
LAYERS = (  # a module imports from its own layer and from those above it in this list, without cycles
    ("errors", "interrupts", "knob", "settings", "optics", "sampling", "tone", "data", "files", "picture", "cache"),
    ("camera", "controls"),
    ("scene",),
    ("bvh",),
    ("frame",),
    ("gpu",),
    ("renderer", "session", "presets"),
    ("measure",),
    ("panel",),
    ("window",),
    ("bench_options", "bench_command"),
    ("commands", "info_command", "plan_command", "tune_command"),
    ("cli", "__main__"),
)
RANK = {unit: rank for rank, units in enumerate(LAYERS) for unit in units}
GRAPHICS = {"moderngl", "moderngl_window", "pyglet", "glfw", "OpenGL"}
OWNERS_OF_GRAPHICS = {"gpu", "renderer", "window"}
MODULES = sorted(path for path in APP.rglob("*.py") if path != APP / "__init__.py")


def unit_of(path: Path) -> str:
    """The child of `app` that a file belongs to: `frame/plan.py` -> `frame`, `camera.py` -> `camera`."""
    return path.relative_to(APP).parts[0].removesuffix(".py")


def imported(path: Path) -> set[tuple[str, ...]]:
    """Every module a file imports anywhere in it, as name parts; relative ones resolved to `("app", ...)`."""
    package = ("app", *path.relative_to(APP).parent.parts)
    found: set[tuple[str, ...]] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {tuple(alias.name.split(".")) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else ()
            module = base + tuple((node.module or "").split(".") if node.module else ())
            found |= {(*module, alias.name) for alias in node.names} if module == ("app",) else {module}
    return found


def units_used(path: Path) -> set[str]:
    """The other children of `app` that a file imports from."""
    return {name[1] for name in imported(path) if name[0] == "app" and len(name) > 1} - {unit_of(path)}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(APP)))
def test_a_module_imports_only_from_lower_layers(path: Path) -> None:
    assert unit_of(path) in RANK, f"{unit_of(path)} has no layer yet: give it one in LAYERS"
    upwards = {unit for unit in units_used(path) if RANK.get(unit, len(LAYERS)) > RANK[unit_of(path)]}
    assert not upwards, f"{path.relative_to(APP)} imports upwards from {sorted(upwards)}"


def test_no_two_parts_need_each_other() -> None:
    graph: dict[str, set[str]] = {}
    for path in MODULES:
        graph.setdefault(unit_of(path), set()).update(units_used(path))
    TopologicalSorter(graph).prepare()  # raises CycleError, which names the cycle


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(APP)))
def test_only_the_gpu_side_knows_a_graphics_library(path: Path) -> None:
    if unit_of(path) not in OWNERS_OF_GRAPHICS:
        assert not GRAPHICS & {name[0] for name in imported(path)}


def test_pyrr_has_one_door() -> None:
    users = [str(path.relative_to(APP)) for path in MODULES if ("pyrr",) in {name[:1] for name in imported(path)}]
    assert len(users) <= 1, f"pyrr's layout and rotation traps are kept behind one module, not {users}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(APP)))
def test_imports_inside_the_package_are_relative(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    absolute = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module]
    assert not [node.module for node in absolute if node.module and node.module.split(".")[0] == "app"]
