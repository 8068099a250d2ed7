"""The one exception a user may cause: a sentence that names the file or option and what to do."""

from __future__ import annotations

import sys

NOT_REACHED = 1  # nothing was wrong, but what was asked for is not to be had
BAD_INPUT = 2  # bad arguments, unreadable or invalid scene
NO_GRAPHICS = 3  # no usable OpenGL 4.3, or no display


_LONGEST = 120  # characters of somebody else's text in one of our sentences


def quoted(text: object) -> str:
    """Text from a file as part of a sentence: one line, nothing that a terminal would obey, not too long."""
    line = " ".join("".join(c if c.isprintable() else " " if c.isspace() else "\ufffd" for c in str(text)).split())
    return line if len(line) <= _LONGEST else line[: _LONGEST - 1] + "\u2026"


def tell(sentence: str) -> None:
    """Write a sentence to stderr, on a line of its own: on a terminal, progress may stand there (commands.py)."""
    blank = "\r\x1b[K" if sys.stderr.isatty() else ""
    print(f"{blank}hybrid-dof: {sentence}", file=sys.stderr)


class UserError(Exception):
    """One clear sentence for stderr, and the exit code that goes with it."""

    def __init__(self, sentence: str, exit_code: int = BAD_INPUT) -> None:
        super().__init__(sentence)
        self.exit_code = exit_code
