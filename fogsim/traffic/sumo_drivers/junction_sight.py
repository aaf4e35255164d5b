"""Foes at junctions, as SUMO reports them, and none where it cannot.

Where no one has the right of way (junctions of type ``unregulated``, also those that netconvert makes so since they
have too many lanes), no one yields; SUMO 1.28 ends with a segmentation fault if it is asked for foes there.
"""

import functools
import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from fogsim.core.files.xml_reader import open_unpacked
from fogsim.traffic.appearance import OTHERS_LAMPS
from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST, intensity_toward
from fogsim.traffic.sumo.link import Api, edge_length, getter, vehicle_getter
from fogsim.traffic.sumo.roster import DueVehicles
from fogsim.traffic.sumo_drivers.unseen import UnseenFoes
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps, VehicleSight
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.traffic.sumo_lanes.route_position import RoutePlaces

_Foe = tuple[str, float, float, float, float, str, str, bool, bool]
"""SUMO's answer: foe, ways of driver and foe to where they cross, and so on; see libsumo's ``getJunctionFoes``."""

_JUNCTION = re.compile(rb'<junction\s[^>]*\btype="(?:traffic_light_)?unregulated"[^>]*>')
_ID = re.compile(rb'\bid="([^"]*)"')


class JunctionFoes:
    """Asks SUMO for foes at junctions."""

    def __init__(self, api: Api, net: Path | None = None) -> None:
        self._api = api
        self._net = net
        self._foes = vehicle_getter(api, "getJunctionFoes")
        self._vehicles, self._places = api.vehicle, RoutePlaces(api)

    @functools.cached_property
    def are_there(self) -> bool:
        """Whether ways cross or merge at any junction; on a motorway without ramps none do."""
        lanes = self._api.lane
        return any(lanes.getInternalFoes(lane) for lane in lanes.getIDList() if lane.startswith(":"))

    @functools.cached_property
    def _unregulated(self) -> frozenset[str]:
        # Only in fog need the file be read.
        return unregulated_junctions(self._net or Path(self._api.simulation.getOption("net-file")))

    @functools.cached_property
    def _leading_there(self) -> frozenset[str]:
        get = self._api.junction.getIncomingEdges
        return frozenset(edge for name in self._unregulated for edge in get(name))

    def ahead_of(self, driver: str, reach: float) -> Sequence[_Foe]:
        """Foes of a driver at the junctions within reach (`reach` [m])."""
        if self._leading_there and self._meets_unregulated(driver, reach):
            return ()
        foes: Sequence[_Foe] = self._foes(driver, reach)
        return foes

    def _meets_unregulated(self, driver: str, reach: float) -> bool:
        vehicles = self._vehicles
        road = str(vehicles.getLaneID(driver)).rpartition("_")[0]
        if road.startswith(":") and road[1:].rpartition("_")[0] in self._unregulated:
            return True
        way = -self._places.find(driver).station
        for edge in vehicles.getRoute(driver)[max(int(vehicles.getRouteIndex(driver)), 0) :]:
            if edge in self._leading_there:
                return True
            way += edge_length(self._api, edge)
            if way > reach:
                return False
        return False


def unregulated_junctions(net: Path) -> frozenset[str]:
    """Junctions of a network at which no one has the right of way; none if there is no such file here."""
    if not net.is_file():
        return frozenset()
    with open_unpacked(net) as source:
        tags = _JUNCTION.findall(source.read())
    return frozenset(found[1].decode() for tag in tags if (found := _ID.search(tag)))


_FARTHEST_FOE = 250.0
"""Foes whose ways to the junction and the driver's add up to more than this do not matter [m]."""

_STANDING_REACH = 12.0
"""A driver who stands looks out for foes up to this distance from where the ways cross [m]."""

_ON_JUNCTION = 15.0
"""A foe with so much way to where the ways cross, or less, may be on the junction [m]."""

_BRAKING = 4.5
"""SUMO's drivers begin to brake for a foe on the junction where this deceleration is enough [m/s²]."""

_MAX_PAUSE = 0.5
"""A driver near a junction looks for foes at least this often [s]."""

_PAUSE_IN_DOUBT = 0.2
"""And for a foe on the way there who may come into sight or get out of it at least this often [s].

For one who may be on the junction, in each step.
"""

_ALONG_A_LANE = 2.0
"""A driver for whom no junction can come near looks at least this often [s]."""

_LONG_LANE = 150.0
"""On shorter lanes a junction is always near [m]."""

_FASTEST_GAIN = 10.0
"""No one is faster by more than this after `_ALONG_A_LANE` [m/s]."""

# Of the lamps that others light, on any side of a vehicle.
_BRIGHTEST = max(BRIGHTEST, intensity_toward(int(OTHERS_LAMPS), 0.0, 1.0, 0.0))


class JunctionSight:
    """Decides which foes at junctions are seen."""

    def __init__(self, view: DriversView, foes: JunctionFoes, vehicle_sight: VehicleSight) -> None:
        api, self._roster, self._reaction_time = view.api, view.roster, view.sight.reaction_time
        self._foes = foes
        self._speed, self._position, self._lane, self._lane_position = view.getters(
            "getSpeed", "getPosition3D", "getLaneID", "getLanePosition"
        )
        length, self._directions = getter(api, "lane", "getLength"), LaneDirections(api)
        # Length [m], and whether somebody may overtake on it.
        self._known_lane = functools.cache(
            lambda lane: (float(length(lane)) if lane else 0.0, self._directions.is_two_way(lane))
        )
        self._vehicle_sight = vehicle_sight
        self._certainly_seen = self._vehicle_sight.certainly_seen
        self._certainly_hidden = view.sight.hidden_distance(view.fog.minimum_extinction, _BRIGHTEST)
        self._unseen = UnseenFoes(api, view.session, self._reaction_time)
        self._due = DueVehicles(view.roster, float(api.simulation.getDeltaT()))

    @property
    def ignored(self) -> dict[str, frozenset[str]]:
        """Foes that are not reacted to, by driver."""
        return {driver: frozenset(self._unseen.of(driver)) for driver in self._unseen.drivers}

    def update(self, own_lamps: OwnLamps) -> None:
        """Make SUMO's drivers ignore foes at junctions that they do not see."""
        if self._certainly_seen >= _FARTHEST_FOE or not self._foes.are_there:
            return
        due = self._due.take()
        if due.gone:
            self._unseen.forget(due.gone, due.new)
        far: list[str] = []
        near: list[str] = []
        doubts: dict[str, dict[str, float]] = {}
        unseen = self._unseen.drivers
        for driver, speed in zip(due.vehicles, map(self._speed, due.vehicles), strict=True):
            if driver not in unseen and self._is_far(driver, speed):
                far.append(driver)
            elif foes := self._foes_in_doubt(driver, speed):
                doubts[driver] = foes
            else:
                near.append(driver)
        self._due.schedule(far, _ALONG_A_LANE)
        self._due.schedule(near, _MAX_PAUSE)
        if doubts:
            self._decide(doubts, own_lamps)

    def _foes_in_doubt(self, driver: str, speed: float) -> dict[str, float]:
        """Foes that matter to a driver and may be out of sight, and when to look for each again [s] (`speed` [m/s])."""
        unseen = self._unseen.of(driver)
        yielding = _STANDING_REACH + speed * (self._reaction_time + 2.0 * _MAX_PAUSE)
        doubtful: dict[str, float] = {}
        near = self._foes.ahead_of(driver, yielding + speed * speed / (2.0 * _BRAKING))
        for foe, way, foe_way, _, _, _, _, must_yield, _ in near:
            is_there = foe_way <= _ON_JUNCTION
            # No straight line is longer than a way between the same places.
            if (is_there or (must_yield and way <= yielding)) and (
                foe in unseen or abs(way) + abs(foe_way) > self._certainly_seen
            ):
                doubtful[foe] = 0.0 if is_there else _PAUSE_IN_DOUBT
        if unseen and not doubtful:
            self._unseen.decide(driver, {}, self._roster.time)
        return doubtful

    def _is_far(self, driver: str, speed: float) -> bool:
        """Whether no junction can come near a driver for `_ALONG_A_LANE` (`speed` [m/s])."""
        lane = self._lane(driver)
        length, is_two_way = self._known_lane(lane)
        if length < _LONG_LANE or (is_two_way and self._directions.is_against(driver, lane)):
            return False
        fastest = speed + _FASTEST_GAIN
        reach = _STANDING_REACH + fastest * (self._reaction_time + 2.0 * _MAX_PAUSE + _ALONG_A_LANE)
        return bool(length - self._lane_position(driver) > reach + fastest * fastest / (2.0 * _BRAKING))

    def _decide(self, doubts: Mapping[str, Mapping[str, float]], own_lamps: OwnLamps) -> None:
        seen = self._seen([(driver, foe) for driver, foes in doubts.items() for foe in foes], own_lamps)
        pauses = []
        for driver, foes in doubts.items():
            is_seen = {foe: (driver, foe) in seen for foe in foes}
            is_emerging = self._unseen.decide(driver, is_seen, self._roster.time)
            pauses.append(0.0 if is_emerging else min(foes.values()))
        self._due.schedule_each(list(doubts), pauses)

    def _seen(self, pairs: Iterable[tuple[str, str]], own_lamps: OwnLamps) -> set[tuple[str, str]]:
        """Those of some pairs of a driver and a foe in which the driver sees the foe."""
        seen: set[tuple[str, str]] = set()
        doubtful: list[tuple[str, str]] = []
        for pair in pairs:
            distance = math.dist(self._position(pair[0]), self._position(pair[1]))
            if distance <= self._certainly_seen:
                seen.add(pair)
            elif distance <= self._certainly_hidden + self._vehicle_sight.length(pair[1]) or pair[1] in own_lamps:
                doubtful.append(pair)
        seen.update(itertools.compress(doubtful, self._vehicle_sight.sees(doubtful, own_lamps)))
        return seen

    def release(self) -> None:
        """Let everyone on the road yield to everyone again."""
        self._unseen.release(self._roster.present)
