"""How far a running mean has come, and how many rows of it fit into a frame's time."""

from __future__ import annotations

from dataclasses import dataclass

SLICE_AIM = 0.7  # part of the time budget that a slice of rows is planned to fill: the estimate is noisy
ROW_STEP = 8  # whole work groups of rows


@dataclass
class Progress:
    """Whole samples, and the row that the next slice starts at."""

    samples: int = 0
    row: int = 0
    rows_per_ms: float = 0.05  # of one sample per pixel; a cautious start, corrected by the first slice

    def restart(self) -> None:
        """Begin again; the speed stays known."""
        self.samples = self.row = 0

    def next_rows(self, height: int, samples: int, budget_ms: float) -> tuple[int, int]:
        """First row and one past the last of a slice that takes about `budget_ms` at `samples` a pixel."""
        rows = int(self.rows_per_ms * budget_ms * SLICE_AIM / samples)
        return self.row, min(height, self.row + max(ROW_STEP, rows // ROW_STEP * ROW_STEP))

    def learn(self, rows: int, seconds: float) -> None:
        """Remember that so many rows of one sample took so long."""
        self.rows_per_ms = 0.5 * self.rows_per_ms + 0.5 * rows / max(1e3 * seconds, 0.1)
