"""Ways across a node: their curves, which of them meet, and who lets whom go first."""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogsim.traffic.templates.alignment import Axis, Points
from fogsim.traffic.templates.net_plan import Edge, Link, NetPlan

_CLEARANCE = 1.9  # [m] ways whose middles come nearer than this meet: the width of a car
_CURVE_POINTS = 13
_OPPOSITE = math.radians(135)  # ways that come from directions farther apart than this are opposite


@dataclass(frozen=True)
class CrossingWay:
    """A way across a node."""

    link: Link  # What it connects
    # source, target: the edges
    source: Edge
    target: Edge

    @functools.cached_property
    def line(self) -> Points:
        """Its middle (n, 3) [m]: a Bézier curve that leaves and arrives in the lanes' directions."""
        one, other = self.source.lane(self.link.from_lane)[-1], self.target.lane(self.link.to_lane)[0]
        apart = math.dist(other, one)
        if apart < 0.5:
            return np.stack([one, other])
        return curve(one, self.source.axis.headings[-1], other, self.target.axis.headings[0])

    @property
    def turn(self) -> float:
        """By how much it turns to the left [rad]."""
        return _turned(float(self.target.axis.headings[0] - self.source.axis.headings[-1]))

    @property
    def length(self) -> float:
        """Length [m]; SUMO requires more than 0."""
        return max(0.1, line_length(self.line))

    @property
    def limit(self) -> float:
        """Speed limit, as its bend allows at a lateral acceleration of 5.5 m/s², which is SUMO's [m/s]."""
        usual = (
            min(self.source.limit, self.target.limit) if self.turn else 0.5 * (self.source.limit + self.target.limit)
        )
        return min(usual, math.sqrt(5.5 * self.length / abs(self.turn))) if abs(self.turn) > 0.05 else usual

    def meets(self, other: "CrossingWay") -> bool:
        """Whether vehicles on it and on another way could collide."""
        if (self.link.source, self.link.from_lane) == (other.link.source, other.link.from_lane):
            return False
        if (self.link.target, self.link.to_lane) == (other.link.target, other.link.to_lane):
            return True
        return bool(np.min(distances(self.line, other.line)) < _CLEARANCE)

    def yields_to(self, other: "CrossingWay") -> bool:
        """Whether who drives on it must let those on a way that it meets go first."""
        if self.source.priority != other.source.priority:
            return self.source.priority < other.source.priority
        left, others_left = self.link.direction == "l", other.link.direction == "l"
        if left != others_left:
            return left
        return clockwise_from_north(self.source) < clockwise_from_north(other.source)

    def is_opposite(self, other: "CrossingWay") -> bool:
        """Whether it comes from about where another way comes from on the other side of the node."""
        return abs(_turned(float(self.source.axis.headings[-1] - other.source.axis.headings[-1]))) > _OPPOSITE


def clockwise_from_north(edge: Edge) -> float:
    """Direction in which an edge lies as seen from the node that it leads to, clockwise from north [rad]."""
    return (1.5 * math.pi - float(edge.axis.headings[-1]) + 1e-9) % (2.0 * math.pi)


def _turned(angle: float) -> float:
    """An angle in −π … π [rad]."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def curve(one: Points, heading: float, other: Points, last_heading: float) -> Points:
    """Cubic Bézier curve from a place (3,) [m] and heading [rad] to another."""
    turn = abs(_turned(last_heading - heading))
    # Handles that make a quarter of a circle of a quarter turn: 4/3 tan(θ/4) of the radius.
    reach = math.dist(other, one) * (2.0 / 3.0 / (1.0 + math.cos(0.5 * turn)))
    handles = [one + reach * _direction(heading), other - reach * _direction(last_heading)]
    handles[0][2], handles[1][2] = (2 * one[2] + other[2]) / 3, (one[2] + 2 * other[2]) / 3
    t = np.linspace(0.0, 1.0, _CURVE_POINTS)[:, None]
    points: Points = (
        (1 - t) ** 3 * one + 3 * t * (1 - t) ** 2 * handles[0] + 3 * t**2 * (1 - t) * handles[1] + t**3 * other
    )
    return points


def _direction(heading: float) -> Points:
    return np.array([math.cos(heading), math.sin(heading), 0.0])


def line_length(line: Points) -> float:
    """Length of a line [m] (`line` (n, 3) [m])."""
    return float(np.sum(np.linalg.norm(np.diff(line, axis=0), axis=1)))


def distances(line: Points, other: Points) -> Points:
    """Distance of each place along a line (n, 3), about half a metre apart, from another line [m]."""
    one, two = _dense(line), _dense(other)
    apart: Points = np.min(np.linalg.norm(one[:, None, :2] - two[None, :, :2], axis=-1), axis=1)
    return apart


def _dense(line: Points) -> Points:
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / 0.5) + 1))
    return np.stack([np.interp(at, along, line[:, k]) for k in range(3)], axis=-1)


def waiting_place(way: CrossingWay, others: Sequence[CrossingWay]) -> float | None:
    """At which share of its way who turns left waits for oncoming vehicles [-]; None if there are none."""
    meeting = [distances(way.line, other.line) for other in others if other.link.target != way.link.target]
    if not meeting:
        return None
    near = np.min(meeting, axis=0) < 0.5 * way.source.lane_width
    first = int(np.argmax(near))
    return first / (len(near) - 1) if near[first] and 0 < first < len(near) - 1 else None


@dataclass(frozen=True, slots=True)
class Layout:
    """A road of a template: its network, and the ways that traffic takes on it."""

    net: NetPlan  # The network
    # Ways by name: ``same_way``, which is the ego's, ``oncoming``, and others that the template has
    ways: tuple[tuple[str, tuple[str, ...]], ...]
    beyond: float = 0.0  # How far the road goes on to the left of a way's left border: median and oncoming lanes [m]
    tunnel: tuple[Axis, float] | None = None  # Left border of the ego's way in a tunnel, and the tunnel's height [m]

    def way(self, name: str) -> tuple[str, ...]:
        """Edges of a way; none where there is no such way."""
        return dict(self.ways).get(name, ())

    def edge(self, name: str) -> Edge:
        """An edge by its id."""
        return next(edge for edge in self.net.edges if edge.name == name)

    def between(self, one: str, other: str) -> float:
        """Length of the way across the junction between two edges [m]."""
        across = (link for link in self.net.links if (link.source, link.target) == (one, other))
        return CrossingWay(next(across), self.edge(one), self.edge(other)).length
