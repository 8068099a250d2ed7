"""What all tests share: one OpenGL context for the whole session, and the optional real scenes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

os.environ.setdefault("HYBRID_DOF_CACHE", str(Path(__file__).parent / ".cache"))

SOAK_TIMEOUT_S = 6 * 3600
SHARED_SCENES = Path(__file__).parents[2] / "shared" / "scenes"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--soak", action="store_true", help="run the tests that have a long form, in their long form")


def pytest_configure(config: pytest.Config) -> None:
    """The short run tries the same examples every time: what it finds was found by whoever changed something."""
    hypothesis.settings.register_profile("short", derandomize=True, deadline=None)
    if not config.getoption("--soak"):
        hypothesis.settings.load_profile("short")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """`--soak` selects the tests that ask for `soak`, and those that try examples: others than the short run's."""
    if config.getoption("--soak"):
        items[:] = [item for item in items if "soak" in getattr(item, "fixturenames", ()) or _tries_examples(item)]
        for item in items:
            item.add_marker(pytest.mark.timeout(SOAK_TIMEOUT_S))


def _tries_examples(item: pytest.Item) -> bool:
    return hypothesis.is_hypothesis_test(getattr(item, "obj", None))


@pytest.fixture(scope="session")
def soak(request: pytest.FixtureRequest) -> bool:
    """Whether to run for long (`make soak`): a test picks its count by it, and checks the same in both forms."""
    return bool(request.config.getoption("--soak"))


@pytest.fixture(scope="session")
def ctx() -> Iterator[object]:
    """The session's only OpenGL context (two in one process confuse driver state)."""
    from app.gpu.context import headless_context

    context = headless_context()
    yield context
    context.release()


@pytest.fixture(autouse=True)
def no_gl_error(request: pytest.FixtureRequest) -> Iterator[None]:
    """GL errors never raise by themselves: each test that touched the context must leave it clean."""
    yield
    if "ctx" in request.fixturenames:
        context = request.getfixturevalue("ctx")
        assert context.error == "GL_NO_ERROR"


@pytest.fixture(scope="session")
def shared_scenes() -> Path:
    """The folder of real scenes that lies beside a developer's checkout."""
    if not SHARED_SCENES.is_dir():
        pytest.skip("the real scenes are not beside this checkout (they are not ours to ship)")
    return SHARED_SCENES
