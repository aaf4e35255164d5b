"""What the faces of signs look like: outlines one within the other, each with its reflectance."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_WHITE, RED, _DARK, YELLOW, _BLUE = 0.66, 0.107, 0.022, 0.42, 0.076
"""Luminous reflectance of the sheeting of signs by day [-]."""


class Outline(Enum):
    """Shape of a face, as the directions of its sides' normals, to the right and down [rad]; a disc has none."""

    DISC = ()
    OCTAGON = tuple(math.pi / 4 * i for i in range(8))
    SQUARE = (0.0, math.pi / 2, math.pi, -math.pi / 2)
    DIAMOND = tuple(math.pi / 4 + math.pi / 2 * i for i in range(4))
    TIP_UP = (math.pi / 2, -math.pi / 6, -5 * math.pi / 6)
    TIP_DOWN = (-math.pi / 2, math.pi / 6, 5 * math.pi / 6)


@dataclass(frozen=True, slots=True)
class Layout:
    """A face: areas one within the other, and where a symbol may be that the layout does not know."""

    outline: Outline  # Shape of all areas
    # (float, float): Size relative to the face's and reflectance of each [-], the largest first
    areas: tuple[tuple[float, float], ...]
    # Width and height of the box around the symbol, relative to the face's diameter, and the mean reflectance there
    # beyond that of what it is printed on [-]; about so, for what is printed differs
    symbol: tuple[float, float, float] | None = None


def _disc(
    symbol: tuple[float, float, float], *, field: float = _WHITE, frame: float = RED, ring: float = 0.78
) -> Layout:
    return Layout(Outline.DISC, ((1.0, _WHITE), (0.965, frame), (ring, field)), symbol)


def _warning(symbol: tuple[float, float, float]) -> Layout:
    return Layout(Outline.TIP_UP, ((1.0, _WHITE), (0.965, RED), (0.72, _WHITE)), symbol)


LAYOUTS = {
    "speed_limit": _disc((0.62, 0.46, -0.28)),
    "end_of_speed_limit": _disc((0.64, 0.64, -0.3), frame=_DARK, ring=0.93),
    "end_of_limits": _disc((0.64, 0.64, -0.25), frame=_DARK, ring=0.93),
    "no_overtaking": _disc((0.57, 0.22, -0.45)),
    "no_entry": _disc((0.74, 0.16, _WHITE - RED), field=RED, ring=0.93),
    "variable_speed_limit": Layout(Outline.SQUARE, ((1.0, _DARK),), (0.92, 0.92, 0.3)),
    "stop": Layout(Outline.OCTAGON, ((1.0, _WHITE), (0.94, RED)), (0.8, 0.34, 0.22)),
    "yield": Layout(Outline.TIP_DOWN, ((1.0, _WHITE), (0.965, RED), (0.6, _WHITE))),
    "priority_road": Layout(Outline.DIAMOND, ((1.0, _DARK), (0.97, _WHITE), (0.72, YELLOW))),
    "motorway": Layout(Outline.SQUARE, ((1.0, _WHITE), (0.92, _BLUE)), (0.7, 0.7, 0.15)),
    "warning": _warning((0.09, 0.41, -0.5)),
    **dict.fromkeys(("fog_warning", "slippery", "curve_left", "curve_right", "queue"), _warning((0.4, 0.4, -0.2))),
}
"""Faces by the kind of the sign; an unknown kind is taken for a plain disc."""

UNKNOWN = Layout(Outline.DISC, ((1.0, _WHITE),), (0.8, 0.8, 0.0))


def layout_of(kind: str) -> Layout:
    """Face of a kind of sign."""
    return LAYOUTS.get(kind.removeprefix("xodr."), UNKNOWN)


_SHARE_STEPS = 0.05
_SHARE_TABLE = np.array([0.5 * math.erfc(-x / math.sqrt(2.0)) for x in np.arange(-5.0, 5.0 + 1e-9, _SHARE_STEPS)])


def _inside(edge_distance: Floats, blur: float) -> Floats:
    """Share of each pixel within an edge that is blurred [-]."""
    return np.asarray(np.interp(edge_distance / blur, np.arange(-5.0, 5.0 + 1e-9, _SHARE_STEPS), _SHARE_TABLE))


def _reach(layout: Layout, right: Floats, down: Floats) -> Floats:
    """Size of the outline through each point over that of the face [-], times the face's radius."""
    directions = layout.outline.value
    if not directions:
        return np.hypot(right, down)
    sides = [right * math.cos(angle) + down * math.sin(angle) for angle in directions]
    # The map's diameter of a triangle is its side, of which the distance of a side from the middle is 1/√12; that of a
    # diamond its diagonal.
    per_radius = {Outline.TIP_UP: math.sqrt(3.0), Outline.TIP_DOWN: math.sqrt(3.0), Outline.DIAMOND: math.sqrt(2.0)}
    return np.asarray(np.max(sides, axis=0) * per_radius.get(layout.outline, 1.0))


def face_maps(
    layout: Layout, right: Floats, down: Floats, radius: float, blur: float, narrowed: float
) -> tuple[Floats, Floats, Floats | None]:
    """Share of each pixel that a face covers, its reflectance there times that, and the share of its symbol's box.

    Takes `right`, `down` (n,) [px], `radius` [px], `blur` [px].
    """
    if layout.outline in (Outline.TIP_UP, Outline.TIP_DOWN):
        # The map's height is that of the middle between tip and base, a quarter of the inscribed circle off its middle.
        down = down + radius * (1.0 if layout.outline is Outline.TIP_DOWN else -1.0) / math.sqrt(12.0)
    reach = _reach(layout, right / narrowed, down)
    covered = _inside(radius - reach, blur)
    light = np.zeros_like(reach)
    for (size, reflectance), (_, outer) in zip(layout.areas, ((0.0, 0.0), *layout.areas), strict=False):
        light += (reflectance - outer) * _inside(size * radius - reach, blur)
    if layout.symbol is None:
        return covered, light, None
    width, height, difference = layout.symbol
    box = _inside(width * radius - np.abs(right) / narrowed, blur) * _inside(height * radius - np.abs(down), blur)
    return covered, light + difference * box, box
