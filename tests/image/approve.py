"""`python -m tests.image.approve [NAME ...]`: draw the golden pictures again. Look at them before you commit.

Without names every picture is drawn, and one that differs within its tolerance is kept as it is. A name approves that
picture whatever changed.
"""

from __future__ import annotations

import argparse
import sys

from app.gpu.context import device_name, headless_context
from app.picture import write_png

from . import goldens
from .goldens import COMPOSED, GOLDENS


def main(arguments: list[str] | None = None) -> int:
    names = [golden.name for golden in (*GOLDENS, *COMPOSED)]
    parser = argparse.ArgumentParser(prog="python -m tests.image.approve", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    chosen = parser.parse_args(arguments).names
    if unknown := sorted({*chosen} - {*names}):
        parser.error(f"there is no golden picture {', '.join(unknown)}; choose from {', '.join(names)}")
    goldens.SCREENSHOTS.mkdir(exist_ok=True)
    ctx = headless_context()
    print(f"drawn by {device_name(ctx)}")
    for golden in GOLDENS:
        if not chosen or golden.name in chosen:
            approve(golden, *goldens.render(ctx, golden), bool(chosen))
    for composed in COMPOSED:
        if not chosen or {composed.name, *composed.parts} & {*chosen}:
            parts = [goldens.stored(part) for part in composed.parts]
            approve(
                composed, composed.compose([p for p in parts if p is not None]), {"made of": list(composed.parts)}, True
            )
    return 0


def approve(
    golden: goldens.Golden | goldens.Composed, actual: goldens.Picture, facts: dict[str, object], named: bool
) -> None:
    """Write the picture unless it is the golden one already, and say what changed."""
    expected = goldens.stored(golden.name)
    if expected is None:
        change = "new"
    elif expected.shape != actual.shape:
        change = f"now {actual.shape[1]}x{actual.shape[0]}, was {expected.shape[1]}x{expected.shape[0]}"
    else:
        found = goldens.difference(expected, actual)
        change = goldens.described(found)
        if not found.mean or (not named and goldens.within(found, golden.tolerance)):
            print(f"  kept   {golden.name}: {change}")
            return
        change += f"; see {goldens.write_difference(golden.name, expected, actual)}"
    write_png(goldens.path_of(golden.name), actual, facts)
    print(f"  wrote  {goldens.path_of(golden.name)}: {change}")


if __name__ == "__main__":
    sys.exit(main())
