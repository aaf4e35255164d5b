"""highway-env's drivers react to others only once they can see them.

Its drivers ask their road for the vehicles ahead and behind, in their own lane and in those to which they could change;
in fog, a road answers with none where the driver sees none. IDM and MOBIL stay as they are. At junctions a road
decides who gives way to whom; in fog drivers give way only to vehicles that they see.
"""

import math
from typing import Any

import numpy as np
from highway_env.road.regulation import RegulatedRoad
from numpy.typing import NDArray

from fogsim.traffic.drivers.eye_heights import EYE_HEIGHTS
from fogsim.traffic.drivers.lamp_intensity import intensity_toward
from fogsim.traffic.drivers.own_beams import head_lamp_light, high_beam_veil
from fogsim.traffic.drivers.sight import DriverSight, FogAccess, inherent_contrast
from fogsim.traffic.highway.fleet import Fleet
from fogsim.traffic.highway.snapshot import front_bumper, rear_bumper


def limit_sight(fog: FogAccess, fleet: Fleet, sight: DriverSight) -> None:
    """Let the drivers of an environment see only what a fog lets them see, until its next reset."""
    # On this one road, not in the library: other environments of the process go on in clear air.
    road = fleet.environment.road
    road.neighbour_vehicles = neighbours = VisibleNeighbours(fog, fleet, sight)
    if isinstance(road, RegulatedRoad):
        road.respect_priorities = neighbours.who_gives_way


class VisibleNeighbours:
    """Stands in for the methods ``neighbour_vehicles`` and ``respect_priorities`` of one road."""

    def __init__(self, fog: FogAccess, fleet: Fleet, sight: DriverSight) -> None:
        self._fog = fog
        self._fleet = fleet
        self._sight = sight
        self._certainly_seen = sight.sure_distance(fog.maximum_extinction)
        self._last_hidden: dict[tuple[Any, Any], float] = {}

    def __call__(self, vehicle: Any, lane_index: Any = None) -> tuple[Any, Any]:
        """Vehicles ahead and behind in a lane; None where the driver has perceived none."""
        road = self._fleet.environment.road
        front, rear = type(road).neighbour_vehicles(road, vehicle, lane_index)
        return (
            front if front is not None and self._perceives(vehicle, front, rear_bumper(front)) else None,
            rear if rear is not None and self._perceives(vehicle, rear, front_bumper(rear)) else None,
        )

    def who_gives_way(self, one: Any, other: Any) -> Any:
        """Which of two vehicles whose ways cross gives way; None if its driver has not perceived the other."""
        giving = type(self._fleet.environment.road).respect_priorities(one, other)
        foe, eye = (other if giving is one else one), front_bumper(giving)
        near_end = min(front_bumper(foe), rear_bumper(foe), key=lambda end: math.dist(eye, end))
        return giving if self._perceives(giving, foe, near_end) else None

    def _perceives(self, vehicle: Any, other: Any, end: NDArray[np.float64]) -> bool:
        """Whether a driver sees another's near end, and has for the reaction time if it was hidden before."""
        pair, now = (vehicle, other), self._fleet.time
        if not self._sees(vehicle, other, end):
            self._last_hidden[pair] = now
            return False
        return now - self._last_hidden.get(pair, -np.inf) >= self._sight.reaction_time

    def _sees(self, vehicle: Any, other: Any, end: NDArray[np.float64]) -> bool:
        lift = np.array([0.0, 0.0, EYE_HEIGHTS["car"]])
        eye = front_bumper(vehicle)
        distance = max(math.dist(eye, end), 0.1)
        if distance <= self._certainly_seen:
            return True
        depth, fleet = float(self._fog.optical_depth(eye + lift, end + lift)), self._fleet
        east, north, _ = eye - front_bumper(other)
        forward_east, forward_north = other.direction
        ahead = float(east * forward_east + north * forward_north)
        aside = float(north * forward_east - east * forward_north)
        lit = intensity_toward(int(fleet.lamps(other)), other.LENGTH, ahead, aside)
        # What is behind stands in no one's own head lamps.
        own = head_lamp_light(int(fleet.lamps(vehicle))) if ahead < 0.0 else 0.0
        glare = high_beam_veil(float(self._fog.extinction(eye + lift))) if own > 1.0 else 0.0
        contrast = inherent_contrast(fleet.paint(other), self._sight.airlight_share)
        return depth <= self._sight.depth_limit(distance, contrast, lit, own, glare)
