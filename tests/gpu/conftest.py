"""What tests of single parts on the GPU share."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import pytest

from app.gpu.programs import Programs


@pytest.fixture
def programs(ctx: moderngl.Context) -> Iterator[Programs]:
    """The shipped shaders, compiled on demand."""
    made = Programs(ctx)
    yield made
    made.release()
