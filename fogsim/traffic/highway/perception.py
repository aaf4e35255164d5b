"""highway-env's drivers react to a leader only once they can see it.

Its drivers ask their road for the vehicle ahead; in fog, a road answers with none where the driver sees none. IDM and
MOBIL stay as they are.
"""

import math
from typing import Any

import numpy as np

from fogsim.traffic.drivers.eye_heights import EYE_HEIGHTS
from fogsim.traffic.drivers.lamp_intensity import HEAD_LAMPS, rear_intensity
from fogsim.traffic.drivers.sight import DriverSight, FogAccess, inherent_contrast
from fogsim.traffic.highway.fleet import Fleet
from fogsim.traffic.highway.snapshot import front_bumper, rear_bumper


def limit_sight(fog: FogAccess, fleet: Fleet, sight: DriverSight) -> None:
    """Let the drivers of an environment see only what a fog lets them see, until its next reset.

    Parameters
    ----------
    fog : FogAccess
        The fog.
    fleet : Fleet
        The vehicles.
    sight : DriverSight
        The drivers' eyes.
    """
    # On this one road, not in the library: other environments of the process go on in clear air.
    fleet.environment.road.neighbour_vehicles = VisibleNeighbours(fog, fleet, sight)


class VisibleNeighbours:
    """Stands in for the method ``neighbour_vehicles`` of one road.

    Parameters
    ----------
    fog, fleet, sight
        As in `limit_sight`.
    """

    def __init__(self, fog: FogAccess, fleet: Fleet, sight: DriverSight) -> None:
        self._fog = fog
        self._fleet = fleet
        self._sight = sight
        self._certainly_seen = sight.sure_distance(fog.maximum_extinction)
        self._last_hidden: dict[tuple[Any, Any], float] = {}

    def __call__(self, vehicle: Any, lane_index: Any = None) -> tuple[Any, Any]:
        """Vehicle ahead, or None if the driver has not perceived it; and vehicle behind, in a lane."""
        road = self._fleet.environment.road
        front, rear = type(road).neighbour_vehicles(road, vehicle, lane_index)
        if front is None or self._perceives(vehicle, front):
            return front, rear
        return None, rear

    def _perceives(self, vehicle: Any, front: Any) -> bool:
        """Tell whether a driver sees what is ahead, and has done so for the reaction time if it was hidden before."""
        pair, now = (vehicle, front), self._fleet.time
        if not self._sees(vehicle, front):
            self._last_hidden[pair] = now
            return False
        return now - self._last_hidden.get(pair, -np.inf) >= self._sight.reaction_time

    def _sees(self, vehicle: Any, front: Any) -> bool:
        lift = np.array([0.0, 0.0, EYE_HEIGHTS["car"]])
        eye, rear = front_bumper(vehicle) + lift, rear_bumper(front) + lift
        distance = max(math.dist(eye, rear), 0.1)
        if distance <= self._certainly_seen:
            return True
        depth, fleet = float(self._fog.optical_depth(eye, rear)), self._fleet
        lit = rear_intensity(int(fleet.lamps(front)))
        head_lamps = 1.0 if int(fleet.lamps(vehicle)) & HEAD_LAMPS else 0.0
        return depth <= self._sight.depth_limit(distance, inherent_contrast(fleet.paint(front)), lit, head_lamps)
