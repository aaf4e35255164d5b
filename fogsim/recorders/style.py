"""Colours and fonts of the video panel, and the colours that report and panel share."""

from functools import cache
from pathlib import Path

import matplotlib as mpl
from PIL import ImageFont

Colour = tuple[int, int, int]

GROUND: Colour = (17, 21, 27)
WELL: Colour = (24, 30, 38)
LINE: Colour = (44, 53, 64)
UNLIT: Colour = (66, 77, 91)
MUTED: Colour = (134, 147, 162)
TEXT: Colour = (231, 236, 242)
TRUTH: Colour = (242, 201, 92)
BELIEF: Colour = (88, 166, 255)
BELIEF_BAND: Colour = (36, 70, 110)
ADVICE: Colour = (86, 200, 140)
ALARM: Colour = (226, 72, 66)
AMBER: Colour = (240, 160, 60)


@cache
def font(size: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """DejaVu Sans, which comes with matplotlib, in a size [px]; loaded once per size."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    path = Path(mpl.get_data_path(), "fonts", "ttf", name)
    return ImageFont.truetype(str(path), size, layout_engine=ImageFont.Layout.BASIC)
