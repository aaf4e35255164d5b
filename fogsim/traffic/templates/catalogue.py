"""Templates of roads by name."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fogsim.core.registry import Registry
from fogsim.traffic.templates.alignment import Axis, Bend, axis_of
from fogsim.traffic.templates.along_roads import (
    ONCOMING,
    SAME_WAY,
    Curve,
    Grade,
    Motorway,
    Rural,
    Straight,
    Tunnel,
    spirals_and_arc,
    straight_links,
)
from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.net_plan import Edge, Link, NetPlan
from fogsim.traffic.templates.placement import TOWN_MIX, USUAL_MIX
from fogsim.traffic.templates.town_roads import Crossing, Roundabout, Streets

RAMP = "ramp"
"""Name of the way from the ramp, and of its first edge."""

_PARALLEL = 40.0  # [m] along which the ramp runs next to the motorway before they are one carriageway
_NOSE = 0.6  # [m] between them there
_PRIORITY, _RAMP_PRIORITY = 10, 5


@dataclass(frozen=True, slots=True)
class _Ramp(Motorway):
    """A motorway with a ramp that comes from the right, and a lane to speed up on, which begins at `ramp_at` [m]."""

    ramp_at: float = 700.0
    ramp_length: float = 350.0
    merge_length: float = 250.0
    ramp_limit: float = 80.0 / 3.6
    ramp_radius: float = 180.0
    ramp_turn: float = math.radians(30.0)

    @property
    def free_length(self) -> float:
        """How far from its beginning the ego's way may be cut [m]."""
        return self.ramp_at

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road; see `RoadTemplate.layout`."""
        axis, merge_end = self.axis(), self.ramp_at + self.merge_length
        inner = axis.moved(-0.5 * self.median)
        usual = (self.lane_width, self.limit, _PRIORITY)
        ends = [0.0, *sorted(cuts), self.ramp_at]
        nodes = ["begin", *(f"cut{number}" for number in range(1, len(ends) - 1)), "merge"]
        before = [
            Edge(_numbered(n), nodes[n], nodes[n + 1], inner.part(ends[n], ends[n + 1]), self.lanes, *usual)
            for n in range(len(ends) - 1)
        ]
        beside = Edge("merging", "merge", "merged", inner.part(self.ramp_at, merge_end), self.lanes + 1, *usual)
        after = Edge("after", "merged", "end", inner.part(merge_end, self.length), self.lanes, *usual)
        ramp = Edge(RAMP, "ramp.begin", "merge", self._ramp(inner), 1, self.lane_width, self.ramp_limit, _RAMP_PRIORITY)
        links = [*straight_links(before), Link(RAMP, "merging", 0, 0)]
        links += [Link(before[-1].name, "merging", lane, lane + 1) for lane in range(self.lanes)]
        links += [Link("merging", "after", lane + 1, lane) for lane in range(self.lanes)]
        same_way = (*(edge.name for edge in before), "merging", "after")
        ways = [(SAME_WAY, same_way), (RAMP, (RAMP, "merging", "after"))]
        edges = [*before, beside, after, ramp]
        if self.oncoming_lanes:
            back = axis.moved(0.5 * self.median).reversed()
            edges.append(Edge(ONCOMING, f"{ONCOMING}.begin", f"{ONCOMING}.end", back, self.oncoming_lanes, *usual))
            ways.append((ONCOMING, (ONCOMING,)))
        return Layout(NetPlan(tuple(edges), tuple(links)), tuple(ways), self.beyond)

    def _ramp(self, inner: Axis) -> Axis:
        """Left border of the ramp, made from its end: it leaves the motorway's right border backwards."""
        there = inner.moved(-self.lanes * self.lane_width).part(self.ramp_at, self.length)
        x, y, z = there.points[0].tolist()
        curve = spirals_and_arc(self.ramp_radius, self.ramp_turn)
        rest = max(20.0, self.ramp_length - _PARALLEL - sum(bend.length for bend in curve))
        heading = float(there.headings[0])
        back = axis_of([Bend(_PARALLEL), *curve, Bend(rest)], (), (x, y, heading + math.pi))
        axis = back.reversed()
        return Axis(axis.points + np.array([0.0, 0.0, z]), axis.headings - 2.0 * math.pi, axis.stations)


def _numbered(number: int) -> str:
    return f"{SAME_WAY}.{number}" if number else SAME_WAY


class RoadTemplate(Protocol):
    """A kind of road; its attributes are its measures, in SI units."""

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road (`cuts` [m])."""

    @property
    def free_length(self) -> float:
        """How far from its beginning the ego's way may be cut [m]."""


ROAD_TEMPLATES: Registry[type[RoadTemplate]] = Registry(
    "road template",
    {
        "motorway": Motorway,
        "ramp": _Ramp,
        "straight": Straight,
        "curve": Curve,
        "grade": Grade,
        "rural": Rural,
        "tunnel": Tunnel,
        "crossing": Crossing,
        "roundabout": Roundabout,
    },
)
"""Templates by name."""


def usual_mix(template: str) -> tuple[tuple[str, float], ...]:
    """Default shares of types of vehicles on a template's roads."""
    return TOWN_MIX if issubclass(ROAD_TEMPLATES[template], Streets) else USUAL_MIX


def measures(template: str) -> tuple[str, ...]:
    """Names of the measures that a template has."""
    return tuple(field.name for field in dataclasses.fields(ROAD_TEMPLATES[template]))  # type: ignore[arg-type]
