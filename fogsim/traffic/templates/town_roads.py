"""Roads that meet: a crossing, with and without lights, and a roundabout."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogsim.traffic.templates.alignment import Axis
from fogsim.traffic.templates.along_roads import ONCOMING, SAME_WAY
from fogsim.traffic.templates.footpaths import ZEBRA_LEAD
from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.net_plan import Edge, Link, NetPlan, Phase, ZebraPlan

_NORTH, _SOUTH = "north", "south"
"""Names of the ways that come from the other roads; the ego comes from the west."""

_ARMS = (SAME_WAY, _SOUTH, ONCOMING, _NORTH)
"""Names of the ways by where they come from: west, south, east, north, counterclockwise."""

_DIRECTIONS = (math.pi, 1.5 * math.pi, 0.0, 0.5 * math.pi)
"""Where these lie as seen from the middle [rad]."""

_CORNER = 6.0  # radius of a crossing's corners [m]
_KERB_CORNER = 3.0  # radius of the corners between crossings on foot [m]
_GREEN, _YELLOW, _RED = 25.0, 3.0, 2.0  # of traffic lights; red is when all have it [s]
_WALK = 18.0  # green for persons [s]
_MAIN, _SIDE = 4, 2  # priorities
_RING_WIDTH = 5.0  # [m]
_ASIDE, _HALF_NODE = math.radians(22.0), math.radians(13.0)  # of entries and exits of a roundabout next to their arm
_APPROACH = 9.0  # from the middle of the ring to where an arm ends [m]
_TURNS = {"straight": 2, "left": 3, "right": 1}
"""Where it goes to, by how many arms on counterclockwise."""


@dataclass(frozen=True, slots=True)
class Streets:
    """Roads that meet in the middle of the ego's way; measures in m, limits in m/s."""

    length: float = 600.0
    lane_width: float = 3.25
    limit: float = 50.0 / 3.6
    side_limit: float = 50.0 / 3.6

    @property
    def free_length(self) -> float:
        """How far from its beginning the ego's way may be cut [m]."""
        return 0.0

    def arm(self, number: int, inner: float, nodes: tuple[str, str], priorities: Sequence[int]) -> tuple[Edge, Edge]:
        """Both directions of the road of one of `_ARMS`, which ends `inner` metres from the middle, at two nodes.

        `priorities` are those of the ego's road and of the other.
        """
        name, away = _ARMS[number], _straight_axis(_DIRECTIONS[number], (inner, 0.5 * self.length))
        is_side = number % 2
        measures = (1, self.lane_width, self.side_limit if is_side else self.limit, priorities[is_side])
        end = f"{name}.end"
        into = Edge(name, end, nodes[0], away.reversed(), *measures)
        return into, Edge(f"{name}.back", nodes[1], end, away, *measures)


def _straight_axis(direction: float, reach: tuple[float, float]) -> Axis:
    """A straight line away from the middle (`direction` [rad], `reach` [m])."""
    along = np.linspace(*reach, 2)
    points = np.stack([along * math.cos(direction), along * math.sin(direction), np.zeros(2)], axis=-1)
    return Axis(points, np.full(2, direction), along)


@dataclass(frozen=True, slots=True)
class Crossing(Streets):
    """Two streets that cross; the ego comes from the west, on the main road; without lights the other gives way.

    Footways are to the right of either direction, with crossings over all roads where they meet.
    """

    lights: bool = False
    footways: bool = False
    footway_width: float = 2.0

    def layout(self, cuts: Sequence[float] = ()) -> Layout:  # noqa: ARG002 - as of `RoadTemplate`
        """The road, which has no cuts."""
        inner, node = self.lane_width + (ZEBRA_LEAD + _KERB_CORNER if self.footways else _CORNER), "middle"
        edges = [edge for number in range(4) for edge in self.arm(number, inner, (node, node), (_MAIN, _SIDE))]
        links, ways = list[Link](), list[tuple[str, tuple[str, ...]]]()
        for (number, name), (turn, steps) in itertools.product(enumerate(_ARMS), _TURNS.items()):
            target = f"{_ARMS[(number + steps) % 4]}.back"
            links.append(Link(name, target, direction=turn[0]))
            ways.append((name if turn == "straight" else f"{name}.{turn}", (name, target)))
        signals = ((node, _two_phases(self.footways)),) if self.lights else ()
        zebras = tuple(ZebraPlan(node, name, f"{name}.back") for name in _ARMS) if self.footways else ()
        if self.footways:
            edges = [replace(edge, footway=self.footway_width) for edge in edges]
        return Layout(NetPlan(tuple(edges), tuple(links), signals, zebras), tuple(ways), self.lane_width)


def _two_phases(walks: bool = False) -> tuple[Phase, ...]:
    """Phases of traffic lights: one road after the other."""
    phases = list[Phase]()
    for greens in ((SAME_WAY, ONCOMING), (_SOUTH, _NORTH)):
        green = [Phase(_WALK, greens, walks=True), Phase(_GREEN - _WALK, greens)] if walks else [Phase(_GREEN, greens)]
        phases += [*green, Phase(_YELLOW, greens, "y"), Phase(_RED, ())]
    return tuple(phases)


@dataclass(frozen=True, slots=True)
class Roundabout(Streets):
    """Four roads that meet at a roundabout, whose lane has a `radius`; the ego goes from the west to the east."""

    radius: float = 18.0
    ring_limit: float = 35.0 / 3.6

    def layout(self, cuts: Sequence[float] = ()) -> Layout:  # noqa: ARG002 - as of `RoadTemplate`
        """The road, which has no cuts."""
        edges, links = list[Edge](), list[Link]()
        for number, name in enumerate(_ARMS):
            into, away = self.arm(number, self.radius + _APPROACH, (f"{name}.in", f"{name}.out"), (_SIDE, _SIDE))
            before, past, after = self._ring(number - 1), self._past(number), self._ring(number)
            edges += [into, away, past, after]
            links += [Link(before.name, past.name), Link(before.name, away.name, direction="r")]
            links += [Link(past.name, after.name), Link(into.name, after.name, direction="r")]
        ways = [
            (name if turn == "straight" else f"{name}.{turn}", self._way(number, steps))
            for number, name in enumerate(_ARMS)
            for turn, steps in _TURNS.items()
        ]
        return Layout(NetPlan(tuple(edges), tuple(links)), tuple(ways), self.lane_width)

    def _way(self, number: int, steps: int) -> tuple[str, ...]:
        """Edges from an arm to one so many arms on."""
        names = [_ARMS[number % 4]]
        for arm in range(number, number + steps):
            names += [self._ring(arm).name, *([self._past(arm + 1).name] if arm + 1 < number + steps else [])]
        return (*names, f"{_ARMS[(number + steps) % 4]}.back")

    def _ring(self, number: int) -> Edge:
        """The ring from behind an arm's entry to before the next arm's exit."""
        name, following = _ARMS[number % 4], _ARMS[(number + 1) % 4]
        between = (_DIRECTIONS[number % 4] + _ASIDE + _HALF_NODE, _DIRECTIONS[number % 4] + 0.5 * math.pi - _ASIDE)
        return self._part(f"{name}.ring", (f"{name}.in", f"{following}.out"), (between[0], between[1] - _HALF_NODE))

    def _past(self, number: int) -> Edge:
        """The ring past an arm, from its exit to its entry."""
        name, middle = _ARMS[number % 4], _DIRECTIONS[number % 4]
        between = (middle - _ASIDE + _HALF_NODE, middle + _ASIDE - _HALF_NODE)
        return self._part(f"{name}.past", (f"{name}.out", f"{name}.in"), between)

    def _part(self, name: str, nodes: tuple[str, str], between: tuple[float, float]) -> Edge:
        angles = np.linspace(*between, 9)
        inner = self.radius - 0.5 * _RING_WIDTH
        points = np.stack([inner * np.cos(angles), inner * np.sin(angles), np.zeros(9)], axis=-1)
        axis = Axis(points, angles + 0.5 * math.pi, inner * (angles - angles[0]))
        return Edge(name, *nodes, axis, 1, _RING_WIDTH, self.ring_limit, _MAIN)
