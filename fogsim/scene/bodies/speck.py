"""Bodies of a few triangles for vehicles that are a handful of pixels in the picture."""

from collections.abc import Sequence
from dataclasses import dataclass

from fogsim.scene.bodies.parts import HEAD_LAMP, POSITION_LAMP, STOP_LAMP, finished, panel_back, panel_front
from fogsim.scene.solids import GLASS, PAINT, TYRE, both_sides, box, merge
from fogsim.values.scene import Mesh


@dataclass(frozen=True, slots=True)
class Outline:
    """What is left of a body's shape at a distance [m].

    Attributes
    ----------
    size : tuple of float
        Length, width and height.
    belt : float
        Height from which on the body is the cabin.
    cabin : tuple of float
        x of the cabin's front and rear and half its width.
    lamps : tuple of float
        Height of the rear lamps' middle, y of their inner edge.
    """

    size: tuple[float, float, float]
    belt: float
    cabin: tuple[float, float, float]
    lamps: tuple[float, float]


OUTLINES = {
    "car": Outline((4.5, 1.8, 1.47), 0.92, (1.7, 4.2, 0.70), (0.80, 0.55)),
    "van": Outline((5.92, 2.0, 2.6), 1.3, (1.1, 5.92, 0.95), (1.18, 0.80)),
    "truck": Outline((16.5, 2.55, 4.0), 1.1, (0.1, 16.5, 1.275), (0.94, 0.70)),
    "bus": Outline((12.0, 2.55, 3.4), 1.9, (0.1, 12.0, 1.22), (1.18, 1.0)),
    "motorcycle": Outline((2.17, 0.8, 1.6), 1.0, (0.7, 1.5, 0.22), (0.85, 0.0)),
}
"""Outlines by kind of body."""


def speck(kind: str) -> Mesh:
    """Shape of a kind of body for the far distance, in a unit box."""
    outline = OUTLINES[kind]
    (length, width, height), (front, rear, half_cabin) = outline.size, outline.cabin
    half = 0.5 * width
    return finished(
        [
            box((0.02, -half, 0.22 * outline.belt), (length - 0.02, half, outline.belt), PAINT),
            box((front, -half_cabin, outline.belt), (min(rear, length - 0.02), half_cabin, height), PAINT),
            *_panes(outline),
            *_lamps(outline),
            _tyres(length, half, 0.3 * outline.belt),
        ],
        length,
        half,
    )


def _panes(outline: Outline) -> Sequence[Mesh]:
    front, rear, half = outline.cabin
    top, bottom = outline.belt + 0.85 * (outline.size[2] - outline.belt), outline.belt + 0.06
    across = (-0.88 * half, 0.88 * half)
    windscreen = panel_front(max(front - 0.04, 0.0), across, (bottom, top), GLASS)
    if outline.size[0] > 15:  # a truck's rear is its load
        return [windscreen]
    return [windscreen, panel_back(min(rear + 0.04, outline.size[0]), across, (bottom, top), GLASS)]


def _lamps(outline: Outline) -> Sequence[Mesh]:
    length, half = outline.size[0], 0.46 * outline.size[1]
    level, inner = outline.lamps
    outer = max(inner + 0.1, min(half, inner + 0.35))
    tail = merge(
        (
            panel_back(length, (inner, outer), (level, level + 0.12), STOP_LAMP),
            panel_back(length, (inner, outer), (level - 0.12, level), POSITION_LAMP),
            panel_front(0.0, (0.6 * half, half), (0.55, 0.72), HEAD_LAMP),
        )
    )
    return [both_sides(tail)]


def _tyres(length: float, half: float, height: float) -> Mesh:
    middle = (0.12 * length, 0.75 * length)
    return both_sides(merge([box((x, half - 0.25, 0.0), (x + 0.12 * length, half, height), TYRE) for x in middle]))
