"""What each pass is for, in the words that its shader opens with."""

from __future__ import annotations

import re
from functools import cache

from ..data import data_dir
from .shaders import stages_of

_CONTRACT = re.compile(r"// (?:Reads|Writes|Fills|Over|Method)\b[^:]*:|[^/]|$")  # where the opening words end
_SENTENCE = re.compile(r".*?\.(?= |$)")


@cache
def purpose(shader: str) -> str:
    """The first sentence of a compute shader, or of the fragment shader of a stem."""
    lines = (data_dir("glsl") / stages_of(shader)[-1]).read_text(encoding="utf-8").splitlines()
    opening = []
    for line in lines:
        if _CONTRACT.match(line):
            break
        opening.append(line.removeprefix("//").strip())
    words = " ".join(opening)
    sentence = _SENTENCE.match(words)
    return sentence[0] if sentence else words
