"""What the measuring tools' command lines share: which subjects, at which size, against how many lens points."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from app.errors import UserError
from app.files import check_folder

from .subjects import SUBJECTS, Subject, left_out, present


def size(text: str) -> tuple[int, int]:
    """(width, height) of "640x360"."""
    width, height = map(int, text.split("x"))
    return width, height


def even(text: str) -> int:
    """A positive even number: a reference is made of two halves."""
    value = int(text)
    if value < 2 or value % 2:
        raise ValueError(text)
    return value


def parser(module: str, doc: str | None, *, spp: int = 1024) -> argparse.ArgumentParser:
    """The options that every measuring tool has."""
    made = argparse.ArgumentParser(prog=f"python -m tests.image.{module}", description=doc)
    made.add_argument("subjects", nargs="*", metavar="SUBJECT", help=f"of {', '.join(s.name for s in SUBJECTS)}")
    made.add_argument("--size", type=size, default=(640, 360), help="of the pictures (default: 640x360)")
    made.add_argument("--frames", type=int, default=16, help="of a still view before it is judged (default: 16)")
    made.add_argument("--spp", type=even, default=spp, help=f"lens points of a reference, even (default: {spp})")
    made.add_argument("-o", dest="output", type=Path, metavar="FILE.md", help="write the tables there, too")
    return made


def chosen(parser: argparse.ArgumentParser, names: Sequence[str], among: Sequence[Subject] = SUBJECTS) -> list[Subject]:
    """The subjects of those names (none: all) that can be opened here; says what is left out."""
    known = {subject.name: subject for subject in among}
    if unknown := sorted({*names} - {*known}):
        parser.error(f"there is no subject {', '.join(unknown)} here; choose from {', '.join(known)}")
    wanted = [known[name] for name in names or known]
    if sentence := left_out(wanted):
        print(sentence)
    return present(wanted)


def check_outputs(parser: argparse.ArgumentParser, *paths: Path | None) -> None:
    """Ends with a sentence if a file cannot be written there, before any time is spent."""
    for path in paths:
        if path is not None:
            try:
                check_folder(path, "output")
            except UserError as error:
                parser.error(str(error))


def report(text: str, path: Path | None) -> None:
    """Print a text, and write it where asked."""
    print(text)
    if path is not None:
        path.write_text(text + "\n", encoding="utf-8")
