"""`python -m app` is `hybrid-dof`."""

from __future__ import annotations

import sys

from .interrupts import interrupted


def main() -> int:
    """Run the program; returns the exit code. What it is made of takes a moment to import, which may be interrupted."""
    try:
        from .cli import main as run

        return run()
    except KeyboardInterrupt:
        return interrupted()


if __name__ == "__main__":
    sys.exit(main())
