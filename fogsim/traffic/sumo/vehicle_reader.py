"""Reading SUMO's vehicles into arrays: what changes for those near the ego, what never changes once."""

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import (
    BODY_PARAMETER,
    OTHERS_LAMPS,
    body_kind,
    cross_section,
    lamps_from_many_signals,
    paint,
)
from fogsim.traffic.sumo.claims import SPEED_FACTOR, TOP_SPEED, Claims
from fogsim.traffic.sumo.link import UNKNOWN, Api, getter, vehicle_getter
from fogsim.traffic.sumo.nearby_vehicles import AllVehicles, NearbyVehicles, positions_of
from fogsim.traffic.sumo.roster import Roster
from fogsim.values import Collision, Lamp, TrafficState
from fogsim.values.traffic import advised_speeds

_CHANGING = ("getAngle", "getSpeed", "getAcceleration", "getSignals", "getLaneID")
"""Getters of what changes."""

# Numbers of SUMO's TraCI protocol, which libsumo and traci share (traci.constants).
_VEHICLES = 0xA4
_SPEED = 0x40
_POSITION_3D = 0x39
_ANGLE = 0x43
_ACCELERATION = 0x72
_LANE = 0x51
_SIGNALS = 0x5B
_SLOPE = 0x36
_MOVING = {
    _POSITION_3D: "getPosition3D",
    _ANGLE: "getAngle",
    _SPEED: "getSpeed",
    _ACCELERATION: "getAcceleration",
    _LANE: "getLaneID",
    _SIGNALS: "getSignals",
    _SLOPE: "getSlope",
}

_MARGIN = 50.0
"""SUMO gathers vehicles by the lanes near the ego; this much more radius leaves none out [m]."""


_TURNS = {"junction": 0.5 * math.pi, "junctionPedestrian": 0.5 * math.pi, "frontal": math.pi}
"""About the angle between the ways of two that collide, by SUMO's types of collisions; 0 of the others [rad]."""


class _DynamicState(NamedTuple):
    """What changes about vehicles, in SUMO's units, by `ids`; a named tuple, made in a third of a dataclass's time."""

    ids: tuple[str, ...]  # Vehicle ids
    position: NDArray[np.float64]  # (n, 3): Middle of the front bumper [m]
    angle: NDArray[np.float64]  # (n,): Heading, clockwise from north [°]
    # speed, acceleration (n,): speed [m/s] and acceleration [m/s²]
    speed: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    lane: tuple[str, ...]  # Lane ids; empty off the lanes
    signals: Sequence[int]  # SUMO's signal bits
    slope: NDArray[np.float64]  # (n,): From the rear to the front bumper, positive uphill [°]


class _Constants(NamedTuple):
    """What never changes about those near, and which row is the ego's."""

    ids: Sequence[str]
    ego: int | None
    kinds: tuple[str, ...]
    sizes: NDArray[np.float64]  # (3, n): Length, width and height
    paint: NDArray[np.float64]
    speed_factor: NDArray[np.float64]
    top_speed: NDArray[np.float64]


class VehicleBodies:
    """Kinds, sizes, paints and wishes of vehicles as a table that grows with every vehicle."""

    def __init__(self, api: Api) -> None:
        self._api = api
        self._row: dict[str, int] = {}
        self._kinds: list[str] = []
        self._numbers = np.empty((64, 8))
        # What drivers do to these in fog is not their own.
        self._wishes = tuple(Claims(api, attribute, "") for attribute in (SPEED_FACTOR, TOP_SPEED))

    def look_up(self, ids: Sequence[str]) -> tuple[tuple[str, ...], NDArray[np.float64]]:
        """Body kinds, and (n, 8) numbers.

        These are length, width, height [m], linear reflectances red, green, blue of the paint, the driver's own speed
        over the limit [-] and the vehicle's own top speed [m/s].
        """
        known = self._row
        try:
            rows = [known[v] for v in ids]
        except KeyError:
            rows = [known[v] if v in known else self._add(v) for v in ids]
        kinds = self._kinds
        return tuple([kinds[row] for row in rows]), self._numbers[rows]

    def forget(self, vehicles: Sequence[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        for vehicle in vehicles:
            self._row.pop(vehicle, None)

    def _add(self, vehicle: str) -> int:
        get, row = self._api.vehicle, len(self._kinds)
        if row == len(self._numbers):
            self._numbers = np.concatenate((self._numbers, np.empty_like(self._numbers)))
        length = get.getLength(vehicle)
        named = get.getVehicleClass(vehicle)
        # Obstacles and persons of OpenSCENARIO are of this class; asking all vehicles would be a message each.
        own = get.getParameter(vehicle, BODY_PARAMETER) if named == "ignoring" else ""
        kind = own or body_kind(named, get.getShapeClass(vehicle), length)
        self._numbers[row, :3] = length, *cross_section(kind, get.getWidth(vehicle), get.getHeight(vehicle))
        self._numbers[row, 3:6] = paint(vehicle, get.getColor(vehicle))
        self._numbers[row, 6:] = [wish.own_value(vehicle) for wish in self._wishes]
        self._kinds.append(kind)
        self._row[vehicle] = row
        return row


class VehicleReader:
    """Reads vehicles by SUMO's plain getters, which inside the process beat subscriptions (`radius` [m])."""

    def __init__(self, api: Api, ego: str | None, radius: float, roster: Roster | None = None) -> None:
        self._api = api
        self._ego = ego
        self._radius = radius
        self._bodies = VehicleBodies(api)
        self._roster = Roster(api) if roster is None else roster
        near = AllVehicles(api, self._roster) if ego is None else NearbyVehicles(api, ego, radius, self._roster)
        self._nearby_vehicles: AllVehicles | NearbyVehicles = near
        self._getters = tuple(vehicle_getter(api, name) for name in _CHANGING)
        self._slope = vehicle_getter(api, "getSlope")
        self._level = math.nan
        self._hits = getter(api, "simulation", "getCollisions")
        limit = getter(api, "lane", "getMaxSpeed")
        # A vehicle off the lanes is limited by nothing but itself.
        self._lane_limit = functools.cache(lambda lane: limit(lane) if lane else math.inf)
        self._mark = 0
        self._constants: _Constants | None = None
        self._free: tuple[tuple[str, ...], _Constants | None, NDArray[np.float64]] = (), None, np.zeros(0)
        self._signals: tuple[Sequence[int], NDArray[np.int32]] = ([], np.zeros(0, dtype=np.int32))

    def state(
        self,
        ego_lamps: Lamp,
        heard: Mapping[str, float] | None = None,
        lamps_of: Mapping[str, Lamp] | None = None,
    ) -> TrafficState:
        """Vehicles near the ego (`heard` [m/s])."""
        now = self._dynamic_state()
        new, self._mark = self._roster.entered_since(self._mark)
        self._bodies.forget(new)
        off_lanes = _off_lanes(now)
        constants = self._constants_of(now.ids)
        ego = constants.ego
        # Whoever gets a state may change its arrays.
        (length, width, height), paint = constants.sizes.copy(), constants.paint.copy()
        lamps = self._lamps(now.signals)
        lit_lamps = [] if ego is None else [(ego, ego_lamps)]
        lit_lamps += [(now.ids.index(other), lit) for other, lit in (lamps_of or {}).items() if other in now.ids]
        for row, lit in lit_lamps:
            lamps[row] = int(lit) | (int(lamps[row]) & int(Lamp.STOP))
        return TrafficState(
            time=self._roster.time,
            ids=now.ids,
            types=constants.kinds,
            position=now.position,
            heading=np.radians(90.0 - now.angle),
            speed=now.speed,
            acceleration=now.acceleration,
            length=length,
            width=width,
            height=height,
            lane=now.lane,
            lamps=lamps,
            paint=paint,
            grade=np.radians(now.slope),
            free_speed=self._free_speeds(now.lane, constants),
            advised_speed=advised_speeds(now.ids, heard or {}),
            off_lanes=off_lanes,
        )

    def _free_speeds(self, lanes: tuple[str, ...], constants: _Constants) -> NDArray[np.float64]:
        """Speeds that drivers would choose freely (n,) [m/s], by the limits found first: later ones are advice."""
        if lanes != self._free[0] or constants is not self._free[1]:
            limits = np.fromiter(map(self._lane_limit, lanes), np.float64, len(lanes)) * constants.speed_factor
            self._free = lanes, constants, np.minimum(limits, constants.top_speed)
        return self._free[2].copy()

    def _lamps(self, signals: Sequence[int]) -> NDArray[np.int32]:
        """Lamps of all by their own signals; computed again when a signal has changed."""
        if signals != self._signals[0]:
            self._signals = signals, lamps_from_many_signals(signals) | np.int32(OTHERS_LAMPS)
        return self._signals[1].copy()

    def _constants_of(self, ids: Sequence[str]) -> _Constants:
        """What never changes; looked up again when other vehicles are near."""
        if self._constants is None or self._constants.ids is not ids:
            kinds, numbers = self._bodies.look_up(ids)
            # Each in memory of its own, as those who read them in each step need it.
            columns, ego = np.ascontiguousarray(numbers.T), None if self._ego is None else ids.index(self._ego)
            paint = np.ascontiguousarray(numbers[:, 3:6])
            self._constants = _Constants(ids, ego, kinds, columns[:3], paint, columns[6], columns[7])
        return self._constants

    def _dynamic_state(self) -> _DynamicState:
        ids, position = self._nearby_vehicles.find()
        angle, speed, acceleration, signals, lane = self._getters
        # One array for all: for few vehicles making arrays costs more than asking.
        flat = itertools.chain(map(angle, ids), map(speed, ids), map(acceleration, ids))
        angles, speeds, accelerations = np.fromiter(flat, np.float64, 3 * len(ids)).reshape(3, -1)
        lanes, lit, slopes = tuple(map(lane, ids)), list(map(signals, ids)), self._slopes(ids, position[:, 2])
        return _DynamicState(ids, position, angles, speeds, accelerations, lanes, lit, slopes)

    def _slopes(self, ids: Sequence[str], heights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slopes (n,) [°], which are not asked for while all stay on the level."""
        if heights.tolist().count(self._level) == len(ids):
            return np.zeros(len(ids))
        slopes = np.fromiter(map(self._slope, ids), np.float64, len(ids))
        # A vehicle that leaves the level, or comes to it, is at another height first.
        self._level = math.nan if slopes.any() or np.ptp(heights) else float(heights[0])
        return slopes

    def _is_near(self, ids: Sequence[str], position: NDArray[np.float64]) -> NDArray[np.bool_]:
        offset = position - position[ids.index(self._ego)]
        return np.asarray(np.hypot(offset[:, 0], offset[:, 1]) <= self._radius)

    def collisions(self) -> list[Collision]:
        """Collisions of the last step; SUMO reports one in every step while the vehicles overlap."""
        hits = self._hits()
        if not hits:
            return []
        time = self._api.simulation.getTime
        return [Collision(time(), c.collider, c.victim, self._impact_speed(c)) for c in hits]

    def _impact_speed(self, hit: Any) -> float:
        """Size of the difference of two velocities [m/s]."""
        vehicle, turn = self._api.vehicle, _TURNS.get(hit.type, 0.0)
        # Those that SUMO has removed already show no headings.
        if turn and {hit.collider, hit.victim}.issubset(vehicle.getIDList()):
            turn = math.radians(vehicle.getAngle(hit.collider) - vehicle.getAngle(hit.victim))
        return math.hypot(hit.colliderSpeed - hit.victimSpeed * math.cos(turn), hit.victimSpeed * math.sin(turn))


def _off_lanes(now: _DynamicState) -> NDArray[np.bool_]:
    """Who is off the lanes (n,); without the acceleration and slope that SUMO reports of these. Empty if none is."""
    if "" not in now.lane:
        return np.zeros(0, np.bool_)
    off_lanes = np.array([not lane for lane in now.lane])
    now.acceleration[off_lanes] = 0.0
    now.slope[now.slope == UNKNOWN] = 0.0
    return off_lanes


class SubscribedReader(VehicleReader):
    """Reads vehicles by subscribing to the surroundings of an ego, which SUMO sends at once.

    The subscription is for this instant alone: SUMO ends itself if one outlives its vehicle, and other
    clients may take the ego away before the next step. The interface and the result are those of
    `VehicleReader`, whose getters cost a message each over a connection.
    """

    _read: tuple[str, ...] = ()
    _entered = 0
    _off_lanes: frozenset[str] = frozenset()
    """Those who came onto the road off the lanes."""

    def _dynamic_state(self) -> _DynamicState:
        if self._ego is None:
            return super()._dynamic_state()
        self._roster.update()
        rows = self._surroundings()
        # Rows of a subscription of the user's own may be among them, with other variables.
        listed = sorted(vehicle for vehicle, row in rows.items() if all(v in row for v in _MOVING))
        position = positions_of(listed, lambda vehicle: rows[vehicle][_POSITION_3D])
        # Far from all lanes a vehicle has no height.
        position[position == UNKNOWN] = 0.0
        near = self._is_near(listed, position)
        ids = self._read = tuple(v for v, is_near in zip(listed, near, strict=True) if is_near)
        return _DynamicState(
            ids=ids,
            position=position[near],
            angle=np.array([rows[v][_ANGLE] for v in ids]),
            speed=np.array([rows[v][_SPEED] for v in ids]),
            acceleration=np.array([rows[v][_ACCELERATION] for v in ids]),
            lane=tuple(rows[v][_LANE] for v in ids),
            signals=[rows[v][_SIGNALS] for v in ids],
            slope=np.array([rows[v][_SLOPE] for v in ids]),
        )

    def _surroundings(self) -> Mapping[str, Mapping[int, Any]]:
        vehicle = self._api.vehicle
        reach = self._radius + _MARGIN
        found = vehicle.getContextSubscriptionResults(self._ego)
        users = {seen: dict(row) for seen, row in found.items()}
        vehicle.subscribeContext(self._ego, _VEHICLES, reach, tuple(_MOVING), end=self._roster.time)
        found = vehicle.getContextSubscriptionResults(self._ego)
        rows: dict[str, Mapping[int, Any]] = dict(found)
        # traci keeps all results of an ego in one place: the user's own stay there alone.
        found.clear()
        found.update(users)
        # SUMO sends nothing of vehicles that another simulator has put off the lanes.
        new, self._entered = self._roster.entered_since(self._entered)
        present = self._roster.present
        self._off_lanes |= {v for v in present.intersection(new).difference(rows) if not vehicle.getLaneID(v)}
        for missing in present.intersection((self._ego, *self._read, *self._off_lanes)).difference(rows):
            rows[missing] = {number: getattr(vehicle, name)(missing) for number, name in _MOVING.items()}
        return rows
