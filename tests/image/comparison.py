"""The comparison picture: the same detail of several views, enlarged, side by side, labelled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

Box = tuple[int, int, int, int]  # left, top, right, bottom, px from the top left

LABELS = ("post-process", "hybrid", "ray-traced")
DETAIL: Box = (262, 66, 402, 206)  # of still-life at 640x360: leaves before vase, wall and lights
TRAIN: Box = (140, 40, 280, 180)  # of toy-train at 640x360: a blurred wheel before houses and lights
ZOOM = 3
GAP = 6  # px between the details
LABEL_HEIGHT = 28  # px
TEXT, PAPER = (20, 20, 20), (255, 255, 255)


def still_life(pictures: list[np.ndarray]) -> np.ndarray:
    """One detail of each picture (h, w, 3) uint8, in the order of LABELS."""
    return contact_sheet(pictures, LABELS, DETAIL, ZOOM, len(LABELS))


def toy_train(pictures: list[np.ndarray]) -> np.ndarray:
    """The same of the other scene."""
    return contact_sheet(pictures, LABELS, TRAIN, ZOOM, len(LABELS))


def contact_sheet(
    pictures: Sequence[np.ndarray], labels: Sequence[str], detail: Box, zoom: int, columns: int
) -> np.ndarray:
    """The same detail [px of the pictures] of each picture (h, w, 3) uint8 below its label, enlarged, in rows."""
    left, top, right, bottom = detail
    width, height = (right - left) * zoom, (bottom - top) * zoom
    rows, below = -(-len(pictures) // columns), height + LABEL_HEIGHT
    sheet = Image.new("RGB", (columns * (width + GAP) - GAP, rows * below), PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=18)
    for i, (picture, label) in enumerate(zip(pictures, labels, strict=True)):
        x, y = i % columns * (width + GAP), i // columns * below
        enlarged = Image.fromarray(picture).crop(detail).resize((width, height), Image.Resampling.NEAREST)
        sheet.paste(enlarged, (x, y + LABEL_HEIGHT))
        pen.text((x + width // 2, y + LABEL_HEIGHT // 2), label, TEXT, font, anchor="mm")
    return np.asarray(sheet)
