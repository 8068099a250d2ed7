"""What the tests of the measuring tools share."""

from __future__ import annotations

from pathlib import Path

import pytest

from . import references


@pytest.fixture
def cached(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty folder for references."""
    monkeypatch.setattr(references, "FOLDER", tmp_path / "references")
    return tmp_path / "references"
