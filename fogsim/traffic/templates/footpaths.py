"""Ways of persons at a junction: zebra crossings over its roads, and the areas that join footways and crossings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogsim.traffic.templates.alignment import Points
from fogsim.traffic.templates.layout import CrossingWay, curve, distances
from fogsim.traffic.templates.net_plan import Edge

ZEBRA_WIDTH = 4.0
"""How far persons on a crossing may walk from one another, along the road [m]."""

STOP_TO_ZEBRA = 1.0
"""From the line at which vehicles stop to the crossing [m]."""

ZEBRA_LEAD = STOP_TO_ZEBRA + ZEBRA_WIDTH
"""From that line to the far side of the crossing [m]."""

_SAME_ARM = 0.3  # angle up to which two edges are one road [rad]


@dataclass(frozen=True, slots=True)
class Zebra:
    """A crossing of persons over a road, at one of its ends."""

    name: str  # Id of its edge
    # into, away: the edges of that road that lead to the node, and away from it
    into: Edge
    away: Edge

    @property
    def line(self) -> Points:
        """Its middle (2, 3), from the side of the edge that leads away to the other [m]."""
        heading = float(self.into.axis.headings[-1])
        (x, y, z), (end_x, end_y, end_z) = self.into.axis.points[-2:].tolist()
        ahead = _ahead(heading) + np.array([0.0, 0.0, (end_z - z) / math.hypot(end_x - x, end_y - y)])
        left = np.array([-ahead[1], ahead[0], 0.0])
        middle = self.into.axis.points[-1] + (STOP_TO_ZEBRA + 0.5 * ZEBRA_WIDTH) * ahead
        return np.stack([middle + self.away.width * left, middle - self.into.width * left])

    def is_met_by(self, way: CrossingWay) -> bool:
        """Whether a way of vehicles leads over it."""
        return way.source == self.into or way.target == self.away


@dataclass(frozen=True, slots=True)
class WalkingArea:
    """Where a footway that leads to a node goes on as one that leads away, around a corner or along the road."""

    name: str  # Id of its edge
    # into, away: the edges next to which the footways lie
    into: Edge
    away: Edge
    leads: tuple[float, float]  # How far the kerb goes straight on from either: past a crossing [m]

    @property
    def outline(self) -> Points:
        """Its border (n, 3): across one footway, along the back, across the other, and along the kerb [m]."""
        kerb = self._border(self.into.width, self.away.width)
        back = self._border(self.into.outer_width, self.away.outer_width)
        return np.concatenate([back, kerb[::-1]])

    def _border(self, before: float, after: float) -> Points:
        headings = float(self.into.axis.headings[-1]), float(self.away.axis.headings[0])
        one, other = self.into.axis.beside(-before)[-1], self.away.axis.beside(-after)[0]
        straight = [one + self.leads[0] * _ahead(headings[0]), other - self.leads[1] * _ahead(headings[1])]
        turn = abs(math.remainder(headings[1] - headings[0], math.tau))
        bend = curve(straight[0], headings[0], straight[1], headings[1]) if turn > _SAME_ARM else np.stack(straight)
        line = np.concatenate([[one], bend, [other]])
        kept = np.concatenate([[True], np.linalg.norm(np.diff(line, axis=0), axis=1) > 0.01])
        border: Points = line[kept]
        return border


def place_before(way: CrossingWay, zebra: Zebra) -> float:
    """At which share of its way across a node who turns waits for those who cross the road beyond [-]."""
    apart = distances(way.line, zebra.line)
    return max(1, int(np.argmax(apart < 0.5 * ZEBRA_WIDTH))) / (len(apart) - 1)


def _ahead(heading: float) -> Points:
    return np.array([math.cos(heading), math.sin(heading), 0.0])


def walking_areas(
    node: str, around: tuple[Sequence[Edge], Sequence[Edge]], zebras: Sequence[Zebra]
) -> tuple[WalkingArea, ...]:
    """Areas that join the footways at a node; none where a road ends."""
    crossed_in, crossed_out = ({zebra.into.name for zebra in zebras}, {zebra.away.name for zebra in zebras})
    joined = list[tuple[Edge, Edge]]()
    for into in (edge for edge in around[0] if edge.footway):
        corners = [(_corner(into, away), away) for away in around[1] if away.footway]
        others = [(angle, away) for angle, away in corners if angle > _SAME_ARM]
        if others:
            joined.append((into, min(others, key=lambda one: one[0])[1]))
    return tuple(
        WalkingArea(
            f":{node}_w{number}",
            into,
            away,
            (ZEBRA_LEAD * (into.name in crossed_in), ZEBRA_LEAD * (away.name in crossed_out)),
        )
        for number, (into, away) in enumerate(joined)
    )


def _corner(into: Edge, away: Edge) -> float:
    """Angle between two roads, counterclockwise from the one that leads to their node [rad]; 0 for the same road."""
    angle = (float(away.axis.headings[0]) - float(into.axis.headings[-1]) - math.pi) % math.tau
    return 0.0 if angle > math.tau - _SAME_ARM else angle
