"""Whom a vehicle in SUMO follows: the next one ahead that goes the same way and overlaps its width.

SUMO's own ``getLeader`` names the next vehicle in the lane, also one next to the follower where the sublane model lets
two drive side by side, and one that comes toward it while it overtakes on the oncoming lane.
"""

import bisect
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from fogsim.traffic.sumo.link import Api, Getter, getter, inner_lanes, vehicle_getter, vehicle_getters
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.values import Leader, TrafficState

_EGO_REACH = 500.0
"""How far ahead a leader of the ego is searched [m]."""

_LONGEST = 25.0
"""Vehicles that are longer than this may be missed where another is nearer by its front [m]."""


class _LaneSpots:
    """Where vehicles are across their edge, in SUMO's measure of lanes; `is_divided` in its sublane model."""

    def __init__(self, api: Api, remote: bool = False) -> None:
        self.is_divided = float(api.simulation.getOption("lateral-resolution")) > 0.0
        (self._lateral,) = vehicle_getters(api, remote and self.is_divided, ("getLateralLanePosition",))
        self._width = getter(api, "lane", "getWidth")
        self._middles: dict[str, float] = {}

    def across(self, vehicle: str, lane: str) -> float:
        """Offset of a vehicle's middle from the border of its edge next to lane 0 [m]."""
        return self.middle(lane) + float(self._lateral(vehicle))

    def middle(self, lane: str) -> float:
        """Offset of a lane's middle from the border of its edge next to lane 0 [m]."""
        known = self._middles.get(lane)
        if known is None:
            edge, _, number = lane.rpartition("_")
            beside = sum(float(self._width(f"{edge}_{n}")) for n in range(int(number)))
            known = self._middles[lane] = beside + 0.5 * float(self._width(lane))
        return known


class _Spot(NamedTuple):
    """A vehicle on an edge: where along it in its own direction, and where across it [m]."""

    vehicle: str
    lane: str
    is_against: bool
    station: float
    across: float
    length: float
    width: float


class Leaders:
    """Finds leaders."""

    def __init__(self, api: Api, remote: bool = False) -> None:
        self._api, self._remote = api, remote
        self._spots, self._directions = _LaneSpots(api, remote), LaneDirections(api)
        self._lane, self._station = vehicle_getters(api, remote, ("getLaneID", "getLanePosition"))
        self._now = getter(api, "simulation", "getTime")
        self._on_edge = getter(api, "edge", "getLastStepVehicleIDs")
        self._lane_length, self._links = getter(api, "lane", "getLength"), getter(api, "lane", "getLinks")
        reach = {"getLeader": ("d", _EGO_REACH)}
        (self._in_lane,) = vehicle_getters(api, remote and self._spots.is_divided, ("getLeader",), reach)
        self._speed = vehicle_getter(api, "getSpeed")
        self._minimum_gap = vehicle_getter(api, "getMinGap")
        self._sizes: dict[str, tuple[float, float]] = {}
        self._ways: dict[tuple[str, str], tuple[str, ...]] = {}
        self._read: tuple[float, dict[str, list[_Spot]]] = (-1.0, {})

    def within(self, reach: float) -> Getter:
        """Getter like SUMO's ``getLeader``, which it is if lanes are not shared, called with vehicle and reach [m]."""
        if self._spots.is_divided:
            return self.find
        (in_lane,) = vehicle_getters(self._api, self._remote, ("getLeader",), {"getLeader": ("d", reach)})
        return in_lane

    def of_ego(self, ego: str) -> Leader | None:
        """The ego's leader."""
        found = self.find(ego, _EGO_REACH) if self._spots.is_divided else self._of_ego_in_lane(ego)
        if not found or not found[0]:
            return None
        # SUMO's gap leaves out the follower's minimum gap.
        return Leader(found[0], found[1] + self._minimum_gap(ego), self._speed(found[0]))

    def _of_ego_in_lane(self, ego: str) -> tuple[str, float] | None:
        is_against, lane = self._directions.is_against, self._lane
        if is_against(ego, lane(ego)):
            return self.find(ego, _EGO_REACH)
        found: tuple[str, float] | None = self._in_lane(ego, _EGO_REACH)
        return self.find(ego, _EGO_REACH) if found and found[0] and is_against(found[0], lane(found[0])) else found

    def find(self, vehicle: str, reach: float) -> tuple[str, float] | None:
        """Leader of a vehicle, and the gap to it less the follower's minimum gap [m]; None if there is none."""
        lane = self._lane(vehicle)
        if not lane:
            return None
        own = self._spot(vehicle, lane)
        best, gap, passed = "", reach, set[str]()
        for begin, current in self._lanes_ahead(own, reach):
            if begin - own.station - _LONGEST > gap:
                break
            across = own.across - self._spots.middle(lane) + self._spots.middle(current)
            least, edge = own.station if begin == 0.0 else -1.0, current.rpartition("_")[0]
            passed.add(edge)
            for other in self._from(edge, least):
                if begin + other.station - own.station - _LONGEST > gap:
                    break
                is_beside = abs(other.across - across) >= 0.5 * (other.width + own.width)
                if is_beside or other.is_against != own.is_against or other.vehicle == vehicle:
                    continue
                apart = begin + other.station - other.length - own.station
                if apart < gap:
                    best, gap = other.vehicle, apart
        minimum = float(self._minimum_gap(vehicle))
        # Only SUMO's own names whoever turns off with its rear still in the way, or comes into it inside a junction.
        found = None if own.is_against else self._in_lane(vehicle, _EGO_REACH)
        if found and found[0] and found[1] + minimum < gap:
            lane = self._lane(found[0])
            if lane and lane.rpartition("_")[0] not in passed and not self._directions.is_against(found[0], lane):
                return found[0], found[1]
        return (best, gap - minimum) if best else None

    def _lanes_ahead(self, own: _Spot, reach: float) -> Iterator[tuple[float, str]]:
        """Lanes on a vehicle's way, and where each begins, from the beginning of its own [m]."""
        yield 0.0, own.lane
        if own.is_against:
            return
        get, begin, lane = self._api.vehicle, float(self._lane_length(own.lane)), own.lane
        route = iter(get.getRoute(own.vehicle)[max(int(get.getRouteIndex(own.vehicle)), 0) + 1 :])
        following = next(route, "")
        while following and begin - own.station < reach:
            way = self._way(lane, following)
            for lane in way:
                yield begin, lane
                begin += float(self._lane_length(lane))
            if not way:
                return
            following = next(route, "")

    def _way(self, lane: str, following: str) -> tuple[str, ...]:
        """Lanes from one to the next edge, and that edge's; by a lane at its side where it does not lead there."""
        known = self._ways.get((lane, following))
        if known is None:
            edge, _, number = lane.rpartition("_")
            lanes = range(1 if edge.startswith(":") else int(self._api.edge.getLaneNumber(edge)))
            nearest = sorted(lanes, key=lambda other: abs(other - int(number)))
            candidates = [lane] if edge.startswith(":") else [f"{edge}_{other}" for other in nearest]
            links = (link for one in candidates for link in self._links(one))
            there = (link for link in links if link[0].rpartition("_")[0] == following)
            ways = ((*inner_lanes(self._links, link[4]), link[0]) for link in there)
            known = self._ways[lane, following] = next(ways, ())
        return known

    def _from(self, edge: str, station: float) -> Iterator[_Spot]:
        """Vehicles on an edge whose fronts are past a station [m], in their order."""
        now, read = self._read
        if now != self._now():
            read = {}
            self._read = self._now(), read
        if edge not in read:
            spots = [self._spot(v, lane) for v in self._on_edge(edge) if (lane := self._lane(v))]
            read[edge] = sorted(spots, key=attrgetter("station"))
        spots = read[edge]
        return itertools.islice(spots, bisect.bisect_right(spots, station, key=attrgetter("station")), None)

    def _spot(self, vehicle: str, lane: str) -> _Spot:
        size = self._sizes.get(vehicle)
        if size is None:
            get = self._api.vehicle
            size = self._sizes[vehicle] = float(get.getLength(vehicle)), float(get.getWidth(vehicle))
        station, is_against = float(self._station(vehicle)), self._directions.is_against(vehicle, lane)
        if is_against:
            # SUMO counts from where the oncoming lane begins.
            station = float(self._lane_length(lane)) - station
        return _Spot(vehicle, lane, is_against, station, self._spots.across(vehicle, lane), *size)


class Courses:
    """Adds to a state what vehicles drive along where that is not their lane alone."""

    def __init__(self, api: Api, remote: bool = False) -> None:
        self._spots = _LaneSpots(api, remote)
        self._directions = LaneDirections(api)
        self._last: tuple[tuple[str, ...], tuple[str, ...]] = (), ()
        self._against: Sequence[int] = ()

    def add(self, state: TrafficState) -> TrafficState:
        """The state with `TrafficState.course` and `TrafficState.across`; as it is where all just keep to lanes."""
        if (state.ids, state.lane) != self._last:
            self._last = state.ids, state.lane
            self._against = self._directions.against(state.ids, state.lane)
        if not self._against and not self._spots.is_divided:
            return state
        course, across = list(state.lane), state.across
        if self._spots.is_divided:
            course = [lane.rpartition("_")[0] for lane in course]
            spots = (
                self._spots.across(v, lane) if lane else 0.0 for v, lane in zip(state.ids, state.lane, strict=True)
            )
            across = np.fromiter(spots, np.float64, len(state.ids))
        for row in self._against:
            course[row] = f"-{course[row]}"
        return replace(state, course=tuple(course), across=across)
