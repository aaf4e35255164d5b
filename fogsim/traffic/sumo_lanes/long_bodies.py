"""Bodies that bend: trains, trams, road trains and articulated buses in pieces along the lanes that they are on."""

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import RAILWAYS
from fogsim.traffic.sumo.link import Api, Getter, inner_lanes, vehicle_getters
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.values import Collision, TrafficState
from fogsim.values.traffic import BodyPieces

LONGEST_RIGID = 15.0
"""Longer bodies are in pieces [m]."""

_RAIL_CARRIAGE, _TRAM_CARRIAGE, _BUS_SECTION, _TRAILER = 25.0, 10.0, 9.0, 13.6
"""About how long the pieces of bodies are whose type has no ``carriageLength`` [m]."""

_LONGEST_SEMITRAILER = 18.75
"""Trucks up to this are a tractor and one trailer [m]."""

_TRACTOR, _COUPLED = 6.2, 2.85
"""Length of a tractor, and how far behind its front its trailer begins [m]; both for a semitrailer of `_MODEL`."""

_MODEL = 16.5
"""Length of the semitrailer that shapes are modelled after [m]."""

_RAIL_GAP = 0.6
"""Between the carriages of a train [m]."""

_STRAIGHT = 0.1
"""A semitrailer whose joints are this near to a straight line is in one piece [m]."""

_GENTLE = 0.045
"""On lanes that turn by no more than this over the length of a semitrailer none bends [rad]."""

_Point = tuple[float, float, float]


class _Section(NamedTuple):
    """A rigid part of a body: its kind, and how far behind the front bumper it begins and ends [m]."""

    kind: str
    start: float
    end: float


class Part(NamedTuple):
    """A straight part of a body."""

    front: _Point  # Middle of its front end on the road [m]
    heading: float  # Its direction [rad]
    length: float  # Its length [m]
    behind: float  # How far behind the front bumper of the body it begins [m]


class LongBodies:
    """Adds the pieces of long bodies to a state."""

    def __init__(self, api: Api, remote: bool = False) -> None:
        self._api, self._remote = api, remote
        self._ids: Sequence[str] = ()
        self._rows: list[tuple[int, tuple[_Section, ...]]] = []
        self._known: dict[tuple[str, float], tuple[_Section, ...]] = {}
        self._gentle: dict[str, bool] = {}
        self._before: dict[tuple[str, int, str], tuple[str, ...]] = {}

    @functools.cached_property
    def _station(self) -> Getter:
        (station,) = vehicle_getters(self._api, self._remote, ("getLanePosition",))
        return station

    @functools.cached_property
    def _directions(self) -> LaneDirections:
        return LaneDirections(self._api)

    def add(self, state: TrafficState) -> TrafficState:
        """The state with `TrafficState.pieces`; as it is where no body bends."""
        if state.ids is not self._ids:
            self._ids = state.ids
            long = np.flatnonzero(state.length > LONGEST_RIGID).tolist()
            self._rows = [(row, self._sections(state.ids[row], float(state.length[row]))) for row in long]
        bent = [bent for row, sections in self._rows if (bent := self._bend(state, row, sections)) is not None]
        return replace(state, pieces=_joined(bent)) if bent else state

    def parts(self, vehicle: str, length: float, front: _Point, heading: float) -> list[Part]:
        """Straight parts of one body [m], the front first; the body itself where it does not bend."""
        joints = None
        if length > LONGEST_RIGID:
            sections = self._sections(vehicle, length)
            joints = self._joints(vehicle, self._api.vehicle.getLaneID(vehicle), sections, front)
        if joints is None:
            return [Part(front, heading, length, 0.0)]
        ends = zip(sections, joints[::2], joints[1::2], strict=True)
        return [
            Part(start, math.atan2(start[1] - end[1], start[0] - end[0]), one.end - one.start, one.start)
            for one, start, end in ends
        ]

    def _sections(self, vehicle: str, length: float) -> tuple[_Section, ...]:
        known = self._known.get((vehicle, length))
        if known is None:
            known = self._known[vehicle, length] = self._read_sections(vehicle, length)
        return known

    def _read_sections(self, vehicle: str, length: float) -> tuple[_Section, ...]:
        vehicle_class = self._api.vehicle.getVehicleClass(vehicle)
        wanted = self._api.vehicletype.getParameter(self._api.vehicle.getTypeID(vehicle), "carriageLength")
        try:
            carriage = max(float(wanted), 1.0)
        except ValueError:
            carriage = math.nan
        return sections(vehicle_class, length, carriage)

    def _bend(
        self, state: TrafficState, row: int, sections: tuple[_Section, ...]
    ) -> "tuple[int, tuple[_Section, ...], list[_Point]] | None":
        joints = self._joints(state.ids[row], state.lane[row], sections, state.position[row])
        return None if joints is None else (row, sections, joints)

    def _joints(
        self, vehicle: str, lane: str, sections: tuple[_Section, ...], front: Sequence[float] | NDArray[np.float64]
    ) -> list[_Point] | None:
        """Where sections begin and end, one after another [m]; None if they are in a straight line as one body."""
        if not lane or self._directions.is_against(vehicle, lane):
            return None
        station = float(self._station(vehicle))
        may_be_rigid = len(sections) == 2 and sections[0].kind == "tractor"
        if may_be_rigid and station >= sections[-1].end and self._is_gentle(lane):
            return None
        lanes = self._lanes_behind(vehicle, lane, sections[-1].end - station)
        # Vehicles need not be in the middle of their lanes, and glide from one lane to another.
        x, y, z = self._point(lanes, station)
        aside = float(front[0]) - x, float(front[1]) - y, float(front[2]) - z
        joints = [self._point(lanes, station - s) for section in sections for s in section[1:]]
        joints = [(x + aside[0], y + aside[1], z + aside[2]) for x, y, z in joints]
        return None if may_be_rigid and _are_in_line(joints) else joints

    def _is_gentle(self, lane: str) -> bool:
        if lane not in self._gentle:
            shape = np.array([point[:2] for point in self._api.lane.getShape(lane)])
            self._gentle[lane] = _most_turn(shape, _LONGEST_SEMITRAILER) <= _GENTLE
        return self._gentle[lane]

    def _lanes_behind(self, vehicle: str, lane: str, missing: float) -> tuple[str, ...]:
        """A lane, and those before it on the vehicle's route over a distance [m], the nearest first."""
        if missing <= 0.0:
            return (lane,)
        index = int(self._api.vehicle.getRouteIndex(vehicle))
        key = (self._api.vehicle.getRouteID(vehicle), index, lane)
        known = self._before.get(key)
        if known is None or sum(self._api.lane.getLength(one) for one in known[1:]) < missing:
            route = self._api.vehicle.getRoute(vehicle)
            known = self._before[key] = tuple(self._walk_back(lane, route[: index + 1], missing))
        return known

    def _walk_back(self, lane: str, route: Sequence[str], missing: float) -> Iterator[str]:
        yield lane
        edges, last = list(route), lane
        if not lane.startswith(":") and edges:
            edges.pop()
        while edges and missing > 0.0:
            for behind in self._lanes_to(last, edges.pop()):
                yield behind
                missing -= float(self._api.lane.getLength(behind))
                last = behind

    def _lanes_to(self, lane: str, edge: str) -> list[str]:
        """Lanes that lead to one from an edge before it, the nearest first; from any lane of it if none leads there."""
        target, best = lane.rpartition("_")[0], list[str]()
        for number in range(int(self._api.edge.getLaneNumber(edge))):
            for link in self._api.lane.getLinks(f"{edge}_{number}"):
                way = [f"{edge}_{number}", *inner_lanes(self._api.lane.getLinks, link[4]), link[0]]
                if lane in way:
                    return way[: way.index(lane)][::-1]
                if way[-1].rpartition("_")[0] == target:
                    best = way[:-1][::-1]
        return best

    def _point(self, lanes: Sequence[str], station: float) -> _Point:
        """Place along lanes, from the beginning of the first one on [m]; straight on behind the last one."""
        for lane in lanes:
            if station >= 0.0 or lane == lanes[-1]:
                break
            lane_behind = lanes[lanes.index(lane) + 1]
            station += float(self._api.lane.getLength(lane_behind))
        edge, _, number = lane.rpartition("_")
        x, y, z = self._api.simulation.convert3D(edge, max(station, 0.0), int(number))
        if station < 0.0:
            ahead_x, ahead_y, ahead_z = self._api.simulation.convert3D(
                edge, min(1.0, float(self._api.lane.getLength(lane))), int(number)
            )
            share = station / max(math.dist((x, y), (ahead_x, ahead_y)), 1e-6)
            return x + share * (ahead_x - x), y + share * (ahead_y - y), z + share * (ahead_z - z)
        return x, y, z


def sections(vehicle_class: str, length: float, carriage: float = math.nan) -> tuple[_Section, ...]:
    """Rigid parts of a long body (`length` [m], `carriage` [m])."""
    if vehicle_class in RAILWAYS:
        usual = _TRAM_CARRIAGE if vehicle_class == "tram" else _RAIL_CARRIAGE
        return _equal("carriage", "carriage", length, usual if math.isnan(carriage) else carriage, _RAIL_GAP)
    if vehicle_class in {"bus", "coach"}:
        return _equal("bus", "carriage", length, _BUS_SECTION if math.isnan(carriage) else carriage, 0.0)
    if length <= _LONGEST_SEMITRAILER:
        scale = length / _MODEL
        coupled = scale * _COUPLED if math.isnan(carriage) or carriage >= length else length - carriage
        return _Section("tractor", 0.0, scale * _TRACTOR), _Section("trailer", coupled, length)
    trailers = _equal(
        "trailer", "trailer", length - _COUPLED, _TRAILER if math.isnan(carriage) else carriage, _RAIL_GAP
    )
    return (
        _Section("tractor", 0.0, _TRACTOR),
        *(_Section(one.kind, one.start + _COUPLED, one.end + _COUPLED) for one in trailers),
    )


def _equal(first: str, others: str, length: float, usual: float, gap: float) -> tuple[_Section, ...]:
    """Equal sections of about a usual length, with gaps between them [m]."""
    count = max(round((length + gap) / (usual + gap)), 1)
    size = (length - gap * (count - 1)) / count
    starts = [number * (size + gap) for number in range(count)]
    return tuple(_Section(others if number else first, at, at + size) for number, at in enumerate(starts))


def _are_in_line(joints: Sequence[_Point]) -> bool:
    """Whether points are near to the straight line from the first to the last."""
    (x, y, _), (end_x, end_y, _) = joints[0], joints[-1]
    length = max(math.hypot(end_x - x, end_y - y), 1e-6)
    east, north = (end_x - x) / length, (end_y - y) / length
    return all(abs((b - y) * east - (a - x) * north) <= _STRAIGHT for a, b, _ in joints)


def _most_turn(shape: NDArray[np.float64], window: float) -> float:
    """Most that a polyline (n, 2) turns within a distance [m] along it [rad]."""
    steps = np.diff(shape, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    steps, lengths = steps[lengths > 1e-3], lengths[lengths > 1e-3]
    headings, corners = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])), np.cumsum(lengths)[:-1]
    turns = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(headings)))))
    after = np.searchsorted(corners, corners + window, side="right")
    return float((turns[after] - turns[:-1]).max(initial=0.0))


def _joined(bodies: "Sequence[tuple[int, tuple[_Section, ...], Sequence[_Point]]]") -> BodyPieces:
    rows, kinds, lengths = list[int](), list[str](), list[float]()
    for row, parts, _ in bodies:
        rows += [row] * len(parts)
        kinds += [part.kind for part in parts]
        lengths += [part.end - part.start for part in parts]
    joints = np.array(list(itertools.chain.from_iterable(points for _, _, points in bodies))).reshape(-1, 2, 3)
    way = joints[:, 0] - joints[:, 1]
    return BodyPieces(
        row=np.array(rows, np.intp),
        kind=tuple(kinds),
        position=joints[:, 0],
        heading=np.arctan2(way[:, 1], way[:, 0]),
        grade=np.arctan2(way[:, 2], np.hypot(way[:, 0], way[:, 1])),
        length=np.array(lengths),
    )


_CARRIAGE = "carriage"


def rail_collisions(state: TrafficState) -> Iterator[Collision]:
    """Road vehicles whose rectangles overlap with those of pieces of a train or tram, in every step while they do."""
    pieces = state.pieces
    if _CARRIAGE not in pieces.kind:
        return
    # A bus is a bus and a carriage; a body of carriages alone is on rails.
    bent = set(pieces.row.tolist())
    on_rails = bent.difference(r for r, kind in zip(pieces.row.tolist(), pieces.kind, strict=True) if kind != _CARRIAGE)
    road = np.array([row for row in range(len(state.ids)) if row not in on_rails], np.intp)
    middle = _middles(state.position[road], state.heading[road], state.length[road])
    carriages = _middles(pieces.position, pieces.heading, pieces.length)
    struck = dict[tuple[int, int], int]()
    for piece, train in enumerate(pieces.row.tolist()):
        if train not in on_rails:
            continue
        reach = 0.5 * (pieces.length[piece] + state.length[road]) + state.width[train] + state.width[road]
        near = np.flatnonzero(np.hypot(*(middle - carriages[piece]).T) < reach)
        own = (carriages[piece], float(pieces.heading[piece]), float(pieces.length[piece]), float(state.width[train]))
        for number in near.tolist():
            row = int(road[number])
            size = float(state.length[row]), float(state.width[row])
            if _overlap(own, (middle[number], float(state.heading[row]), *size)):
                struck.setdefault((row, train), piece)
    for (row, train), piece in sorted(struck.items()):
        turn = float(state.heading[row] - pieces.heading[piece])
        one, other = float(state.speed[row]), float(state.speed[train])
        impact = math.hypot(one - other * math.cos(turn), other * math.sin(turn))
        yield Collision(state.time, state.ids[row], state.ids[train], impact)


def _middles(
    front: NDArray[np.float64], heading: NDArray[np.float64], length: NDArray[np.float64]
) -> NDArray[np.float64]:
    ahead = np.stack((np.cos(heading), np.sin(heading)), axis=1)
    return np.asarray(front[:, :2] - 0.5 * length[:, None] * ahead)


_Rectangle = tuple[NDArray[np.float64], float, float, float]
"""Middle [m], heading [rad], length and width [m]."""


def _overlap(one: _Rectangle, other: _Rectangle) -> bool:
    """Whether two rectangles overlap: no axis of either lies between them."""
    away = other[0] - one[0]
    for heading in (one[1], one[1] + 0.5 * math.pi, other[1], other[1] + 0.5 * math.pi):
        apart = abs(away[0] * math.cos(heading) + away[1] * math.sin(heading))
        reach = sum(_extent(rectangle, heading) for rectangle in (one, other))
        if apart >= 0.5 * reach:
            return False
    return True


def _extent(rectangle: _Rectangle, heading: float) -> float:
    """How long a rectangle is along a direction [m]."""
    _, own, length, width = rectangle
    return abs(length * math.cos(own - heading)) + abs(width * math.sin(own - heading))
