"""The one exception a user may cause: a sentence that names the file or option and what to do."""

from __future__ import annotations

NOT_REACHED = 1  # nothing was wrong, but what was asked for is not to be had
BAD_INPUT = 2  # bad arguments, unreadable or invalid scene
NO_GRAPHICS = 3  # no usable OpenGL 4.3, or no display


class UserError(Exception):
    """One clear sentence for stderr, and the exit code that goes with it."""

    def __init__(self, sentence: str, exit_code: int = BAD_INPUT) -> None:
        super().__init__(sentence)
        self.exit_code = exit_code
