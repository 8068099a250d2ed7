"""pyproject.toml tells the truth: what the package imports is what it declares."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MODULES = sorted((ROOT / "app").rglob("*.py"))


def names(requirements: list[str]) -> set[str]:
    """Normalised distribution names (PEP 503) of requirement strings."""
    return {re.sub(r"[-_.]+", "-", re.split(r"[\[<>=!~; ]", text, maxsplit=1)[0]).lower() for text in requirements}


REQUIRED = names(PROJECT["dependencies"])
USER_EXTRAS = {extra: texts for extra, texts in PROJECT["optional-dependencies"].items() if extra != "dev"}
OPTIONAL = set().union(*(names(texts) for texts in USER_EXTRAS.values()))


def third_party(nodes: Iterator[ast.AST] | list[ast.stmt]) -> set[str]:
    """Top-level names of imports that are neither ours nor the standard library's."""
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.add(node.module.split(".")[0])
    return found - set(sys.stdlib_module_names)


def undeclared(imports: set[str], declared: set[str]) -> set[str]:
    owners = packages_distributions()
    return {name for name in imports if not names(owners.get(name, [name])) & declared}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_import_is_declared(path: Path) -> None:
    assert not undeclared(third_party(ast.walk(ast.parse(path.read_text(encoding="utf-8")))), REQUIRED | OPTIONAL)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_optional_packages_are_imported_only_where_used(path: Path) -> None:
    at_import_time = third_party(ast.parse(path.read_text(encoding="utf-8")).body)
    assert not undeclared(at_import_time, REQUIRED), "a base installation cannot import this module"


def test_what_the_tests_import_is_declared_for_developers() -> None:
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in sorted((ROOT / "tests").rglob("*.py"))]
    imports = set().union(*(third_party(ast.walk(tree)) for tree in trees)) - {"app", "tests"}
    assert not undeclared(imports, REQUIRED | OPTIONAL | names(PROJECT["optional-dependencies"]["dev"]))


def test_the_promised_extras_exist() -> None:
    assert set(PROJECT["optional-dependencies"]) == {"exr", "metrics", "fast", "video", "plots", "dev"}
    assert PROJECT["scripts"] == {"hybrid-dof": "app.__main__:main"}
