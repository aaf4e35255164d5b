"""Whether one vehicle's driver sees another vehicle, wherever it is and whichever side it shows."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from fogsim.obstruction import CLEAR_SIGHT, Obstructions
from fogsim.traffic.drivers.lamp_intensity import head_lamp_share, intensity_toward
from fogsim.traffic.drivers.own_beams import high_beam_veil, uses_high_beam
from fogsim.traffic.drivers.sight import DriverSight, FogAccess
from fogsim.traffic.drivers.sight_kernels import BODY_MIDDLE
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.traffic.sumo_drivers.hidden_vehicles import HiddenVehicles
from fogsim.traffic.sumo_drivers.seen_vehicles import OwnLamps, SeenVehicles
from fogsim.traffic.sumo_lanes.long_bodies import LongBodies, Part

NEAREST = 0.1
"""Distances are at least this [m]."""

FARTHEST = 2000.0
"""No one is seen farther away than this [m]; a vehicle that is teleported is nowhere."""

_Point = tuple[float, float, float]


class LineOfSight(NamedTuple):
    """The straight line from a driver's eyes to the nearest part of another vehicle."""

    # eyes, end: where it begins and ends [m]
    eyes: _Point
    end: _Point
    distance: float  # Its length [m]
    bearing: float  # Its horizontal angle from straight ahead [rad]
    # ahead, aside: where the eyes are, from the middle of the other's front bumper: ahead of it and to its left [m]
    ahead: float
    aside: float


class VehicleSight:
    """Finds which vehicles drivers see, along straight lines through the fog and past what stands next to the road.

    Other vehicles hide no one.
    """

    def __init__(
        self,
        api: Api,
        fog: FogAccess,
        sight: DriverSight,
        remote: bool = False,
        obstructions: Obstructions = CLEAR_SIGHT,
    ) -> None:
        self._hidden_vehicles = HiddenVehicles(api, obstructions, remote) if obstructions else None
        self._fog = fog
        self._sight = sight
        self._vehicles = SeenVehicles(api, remote, sight.airlight_share)
        self._position, self._angle = vehicle_getters(api, remote, ("getPosition3D", "getAngle"))
        self._bodies = LongBodies(api)
        self._extinction = fog.maximum_extinction if fog.minimum_extinction == fog.maximum_extinction else None
        self._seen_through_fog = sight.sure_distance(fog.maximum_extinction)

    @property
    def certainly_seen(self) -> float:
        """Distance up to which every vehicle is seen, wherever it is and whatever its lamps [m]."""
        return self._seen_through_fog if self._hidden_vehicles is None else 0.0

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        self._vehicles.forget(vehicles)
        if self._hidden_vehicles is not None:
            self._hidden_vehicles.forget(vehicles)

    def sees(self, pairs: Sequence[tuple[str, str]], own_lamps: OwnLamps) -> list[bool]:
        """Whether each observer sees its target."""
        lines = [self.line_of_sight(observer, target) for observer, target in pairs]
        seen = [line.distance <= self._seen_through_fog for line in lines]
        doubtful = [n for n, line in enumerate(lines) if not seen[n] and line.distance <= FARTHEST]
        for n, depth in zip(doubtful, self._optical_depths([lines[n] for n in doubtful]), strict=True):
            seen[n] = depth <= self._depth_limit(pairs[n], lines[n], own_lamps)
        if self._hidden_vehicles is None:
            return seen
        hidden = self._hidden_vehicles.are_hidden(pairs)
        return [is_seen and not is_hidden for is_seen, is_hidden in zip(seen, hidden, strict=True)]

    def line_of_sight(self, observer: str, target: str) -> LineOfSight:
        """The straight line from an observer's eyes, above the front bumper, to the nearest part of a target."""
        # Plain numbers: mostly there is a pair or two, and making arrays of them would cost more than all the rest.
        x, y, z = self._position(observer)
        body, heading = self._vehicles.body(target), math.radians(90.0 - self._angle(target))
        parts = self._bodies.parts(target, body.length, self._position(target), heading)
        seen = [_nearest_point(x, y, part, body.width) for part in parts]
        end_x, end_y, front_z, ahead, aside = min(seen, key=lambda point: math.dist(point[:2], (x, y)))
        forward = math.radians(90.0 - self._angle(observer))
        bearing = math.remainder(math.atan2(end_y - y, end_x - x) - forward, math.tau)
        height = self._vehicles.eye_height(observer)
        eyes, end = (x, y, z + height), (end_x, end_y, front_z + min(height, BODY_MIDDLE))
        return LineOfSight(eyes, end, max(math.dist(eyes, end), NEAREST), bearing, ahead, aside)

    def length(self, vehicle: str) -> float:
        """Length of a vehicle [m]; no part of it is farther from its front."""
        return self._vehicles.body(vehicle).length

    def _depth_limit(self, pair: tuple[str, str], line: LineOfSight, own_lamps: OwnLamps) -> float:
        observer, target = pair
        body = self._vehicles.body(target)
        intensity = intensity_toward(self._vehicles.lamps(target, own_lamps), body.length, line.ahead, line.aside)
        head_lamps = self._vehicles.head_lamps(observer, own_lamps) * head_lamp_share(line.bearing)
        glare = 0.0
        if uses_high_beam(own_lamps.get(observer, 0)):
            known = self._extinction
            glare = high_beam_veil(float(self._fog.extinction(line.eyes)) if known is None else known)
        return self._sight.depth_limit(line.distance, body.contrast, intensity, head_lamps, glare)

    def _optical_depths(self, lines: Sequence[LineOfSight]) -> Sequence[float]:
        if self._extinction is not None:
            return [self._extinction * line.distance for line in lines]
        if not lines:
            return []
        eyes, ends = [line.eyes for line in lines], [line.end for line in lines]
        depths: list[float] = self._fog.optical_depth(eyes, ends).tolist()
        return depths


def _nearest_point(x: float, y: float, part: Part, width: float) -> tuple[float, float, float, float, float]:
    """Point of a part of a body that is nearest to a place, the height of its road, and where the place is [m].

    For the last two see `LineOfSight`; the distance along the body up to where the part begins is added.
    """
    front_x, front_y, front_z = part.front
    east, north = math.cos(part.heading), math.sin(part.heading)
    ahead = (x - front_x) * east + (y - front_y) * north
    aside = (y - front_y) * east - (x - front_x) * north
    along = min(max(ahead, -part.length), 0.0)
    across = min(max(aside, -0.5 * width), 0.5 * width)
    point_x, point_y = front_x + along * east - across * north, front_y + along * north + across * east
    return point_x, point_y, front_z, ahead - part.behind, aside
