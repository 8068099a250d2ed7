"""The comparison picture: the same detail of several views, enlarged, side by side, labelled."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

LABELS = ("post-process", "hybrid", "ray-traced")
DETAIL = (262, 66, 402, 206)  # left, top, right, bottom at 640x360: leaves before vase, wall and lights
ZOOM = 3
GAP = 6  # px between the details
LABEL_HEIGHT = 28  # px
TEXT, PAPER = (20, 20, 20), (255, 255, 255)


def side_by_side(pictures: list[np.ndarray]) -> np.ndarray:
    """One detail of each picture (h, w, 3) uint8, in the order of LABELS."""
    left, top, right, bottom = DETAIL
    width, height = (right - left) * ZOOM, (bottom - top) * ZOOM
    sheet = Image.new("RGB", (len(pictures) * (width + GAP) - GAP, height + LABEL_HEIGHT), PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=18)
    for i, (picture, label) in enumerate(zip(pictures, LABELS, strict=True)):
        x = i * (width + GAP)
        detail = Image.fromarray(picture).crop(DETAIL).resize((width, height), Image.Resampling.NEAREST)
        sheet.paste(detail, (x, LABEL_HEIGHT))
        pen.text((x + width // 2, LABEL_HEIGHT // 2), label, TEXT, font, anchor="mm")
    return np.asarray(sheet)
