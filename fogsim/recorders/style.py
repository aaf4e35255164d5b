"""Colours and fonts of the video panel, and the colours that report, overlay and panel share."""

from collections.abc import Sequence
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
    """DejaVu Sans, which comes with matplotlib, in a size [px]; loaded once per size (`size` [px])."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    path = Path(mpl.get_data_path(), "fonts", "ttf", name)
    return ImageFont.truetype(str(path), size, layout_engine=ImageFont.Layout.BASIC)


_NAMED = (
    "negru2013",
    "zhu2015",
    "huang2015",
    "huang2015_rough",
    "huang2015_lead",
    "joint_road",
    "lead_contrast",
    "belaroussi2015",
    "sign_contrast",
    "night_road",
    "gallen2014_veil",
    "gallen2014",
    "gallen2014_halo",
    "hautiere2006_stereo",
    "gabb2014",
    "scatterometer",
)
"""Methods that the first colours belong to, whichever others stand next to them."""

ON_DARK: tuple[Colour, ...] = (
    (210, 255, 15),
    (165, 45, 255),
    (225, 0, 135),
    (150, 105, 75),
    (240, 45, 0),
    (180, 195, 255),
    (0, 150, 30),
    (150, 135, 180),
    (225, 0, 210),
    (165, 240, 240),
    (255, 150, 180),
    (255, 237, 204),
    (189, 159, 123),
    (0, 105, 182),
    (75, 90, 90),
    (165, 0, 135),
    (240, 120, 75),
    (90, 0, 255),
    (180, 195, 0),
    (90, 255, 120),
)
"""Colours as far apart as sixteen can be on a dark ground, the first ones farthest from the panel's belief and truth.

The least colour difference of any two (CIE 1976, ΔE of L*a*b*) is 18 for normal sight and for any of the three
dichromacies as Machado et al. 2009 simulate them; found by search over a grid of all colours of L* 43 … 95. Four that
came later, before the last two, are those of L* 36 and more that lie farthest from the others, at least 13.
"""

ON_LIGHT: tuple[Colour, ...] = (
    (45, 90, 90),
    (165, 45, 255),
    (225, 0, 135),
    (150, 105, 75),
    (105, 45, 0),
    (0, 0, 135),
    (45, 45, 30),
    (150, 135, 180),
    (120, 30, 135),
    (195, 165, 135),
    (255, 135, 90),
    (0, 180, 255),
    (60, 15, 60),
    (0, 0, 240),
    (105, 30, 195),
    (45, 0, 90),
    (105, 75, 60),
    (135, 180, 225),
    (240, 45, 0),
    (0, 150, 30),
)
"""The same on a white ground, ΔE 18 or more, of those that came later 13.

Named methods keep their colour where it is dark enough and far from the report's belief and truth.
"""


def method_colours(methods: Sequence[str], table: Sequence[Colour] = ON_DARK) -> dict[str, Colour]:
    """Colour of each method: of those that come with FogSim always the same, whichever others stand next to it."""
    named, left = dict(zip(_NAMED, table, strict=False)), table[len(_NAMED) :]
    others = dict.fromkeys(name for name in methods if name not in named)
    free = {name: left[i % len(left)] for i, name in enumerate(others)}
    return {name: named[name] if name in named else free[name] for name in methods}
