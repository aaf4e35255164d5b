"""What stands next to a road by template, and tunnels over it: lines of structures, signs, and their file."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogsim.errors import InputError
from fogsim.traffic.road.signs import SIGN_CLEARANCE, SIGN_TYPE, SPEED_LIMIT
from fogsim.traffic.road.structures import STRUCTURE_TYPE
from fogsim.traffic.templates.alignment import Axis, Points
from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.placement import edge_at, way_length
from fogsim.traffic.templates.xml_text import element, opening
from fogsim.units import KMH_PER_MPS

_WALL, _ROOF = 0.6, 0.8  # thickness of a tunnel's walls and roof [m]
_KERB = 1.0  # between a tunnel's carriageway and its walls [m]


@dataclass(frozen=True, slots=True)
class Obstruction:
    """Something next to a way that hides what is behind it."""

    kind: str  # ``wall``, ``hedge``, ``building`` or ``truck``
    way: str  # Way next to which it is
    # at, length: where along it it begins, and how long it is [m]
    at: float
    length: float
    is_left: bool  # Whether it stands to the left of the road, beyond the oncoming lanes
    distance: float  # From the border of the carriageway to its near side [m]
    # width, height: its size across the road, and its height [m]
    width: float
    height: float


def additional_text(layout: Layout, obstructions: Sequence[Obstruction], sign_spacing: float) -> str:
    """Text of an additional file with all that stands next to a road, "" if nothing does (`sign_spacing` [m])."""
    lines = _limit_signs(layout, sign_spacing)
    for number, one in enumerate(obstructions):
        name = f"obstruction.{number}"
        if not layout.way(one.way):
            raise InputError(
                f"obstructions.{number}: the road has no way {one.way!r}; it has {', '.join(dict(layout.ways))}"
            )
        if one.at + one.length > way_length(layout, one.way):
            raise InputError(
                f"obstructions.{number}: ends beyond its way, which is {way_length(layout, one.way):.0f} m long"
            )
        lines += _structure(name, one.kind, _line(layout, one), (one.width, 0.0, one.height))
    if layout.tunnel is not None:
        lines += _tunnel(layout, *layout.tunnel)
    if not lines:
        return ""
    return '<?xml version="1.0" encoding="UTF-8"?>\n<additional>\n' + "\n".join(lines) + "\n</additional>\n"


def _limit_signs(layout: Layout, spacing: float) -> list[str]:
    """Signs that repeat the limit on the right of the ego's way, but in a tunnel (`spacing` [m])."""
    lines = list[str]()
    for number in range(1, math.ceil(way_length(layout, "same_way") / spacing)):
        name, along = edge_at(layout, "same_way", number * spacing)
        edge = layout.edge(name)
        station = float(edge.axis.stations[0]) + along
        if layout.tunnel is not None and layout.tunnel[0].stations[0] <= station <= layout.tunnel[0].stations[-1]:
            continue
        ahead = edge.axis.part(station, station + 1.0)
        (x, y), heading = ahead.beside(-edge.width - SIGN_CLEARANCE)[0, :2].tolist(), float(ahead.headings[0])
        place = {"x": f"{x:.2f}", "y": f"{y:.2f}", "angle": f"{90.0 - math.degrees(heading):.3f}"}
        lines += [
            opening("poi", id=f"limit.{number}", type=f"{SIGN_TYPE}{SPEED_LIMIT}", **place),
            f"    {element('param', key='value', value=f'{edge.limit * KMH_PER_MPS:g}')}",
            "</poi>",
        ]
    return lines


def _line(layout: Layout, one: Obstruction) -> Points:
    """Middle line of an obstruction (n, 3) [m]."""
    aside = one.distance + 0.5 * one.width
    if one.is_left:
        return _along(layout, one.way, one.at, one.length, layout.beyond + aside)
    width = layout.edge(layout.way(one.way)[0]).width
    return _along(layout, one.way, one.at, one.length, -width - aside)


def _along(layout: Layout, way: str, start: float, length: float, left: float) -> Points:
    """Points at a distance to the left of a way's left border, between two places along it."""
    parts, passed = list[Points](), 0.0
    names = layout.way(way)
    for name, following in itertools.zip_longest(names, names[1:]):
        axis = layout.edge(name).axis
        first, last = max(start - passed, 0.0), min(start + length - passed, axis.length)
        if last - first > 0.01:
            offset = float(axis.stations[0])
            parts.append(axis.part(offset + first, offset + last).beside(left))
        passed += axis.length + (layout.between(name, following) if following else 0.0)
    points = np.concatenate(parts)
    kept = np.concatenate([[True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 0.01])
    line: Points = points[kept]
    return line


def _tunnel(layout: Layout, axis: Axis, height: float) -> list[str]:
    """Two walls and a roof over both directions."""
    right = layout.edge(layout.way("same_way")[0]).width + _KERB
    left, middle = layout.beyond + _KERB, 0.5 * (layout.beyond + _KERB - right)
    lines = list[str]()
    for name, aside in (("right", -right - 0.5 * _WALL), ("left", left + 0.5 * _WALL)):
        lines += _structure(f"tunnel.{name}", "tunnel", axis.beside(aside), (_WALL, 0.0, height))
    roof = (left + right + 2 * _WALL, height, height + _ROOF)
    return lines + _structure("tunnel.roof", "tunnel", axis.beside(middle), roof)


def _structure(name: str, kind: str, line: Points, sizes: tuple[float, float, float]) -> list[str]:
    shape = " ".join(f"{x:.2f},{y:.2f},{z:.2f}" for x, y, z in line.tolist())
    measures = zip(("width", "bottom", "top"), sizes, strict=True)
    return [
        opening("poly", id=name, type=f"{STRUCTURE_TYPE}{kind}", color="gray", fill="0", layer="1", shape=shape),
        *(f"    {element('param', key=key, value=f'{size:g}')}" for key, size in measures),
        "</poly>",
    ]
