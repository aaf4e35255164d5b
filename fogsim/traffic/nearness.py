"""Which vehicles are near the ego, without asking all of them where they are in every step."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.getters import vehicle_getter
from fogsim.traffic.link import Api

TOP_SPEED = 100.0
"""Speed that no road vehicle exceeds [m/s]."""

LONGEST_WAIT = 1.0
"""Time after which even a vehicle far away is asked again [s], should somebody have moved it by hand."""


class Nearness:
    """Finds the vehicles near the ego; one far away is asked again only when it could have come near.

    Parameters
    ----------
    api : Api
        The simulation.
    ego : str
        Id of the ego.
    radius : float
        Horizontal distance from the ego's front bumper up to which a vehicle is near [m].
    """

    def __init__(self, api: Api, ego: str, radius: float) -> None:
        self._api = api
        self._ego = ego
        self._radius = radius
        self._position = vehicle_getter(api, "getPosition3D")
        self._due: dict[str, float] = {}
        self._time = -math.inf
        self._ego_at = (math.inf, math.inf)

    def find(self) -> tuple[list[str], NDArray[np.float64]]:
        """Ids of those near in SUMO's order, the ego among them, and their positions (n, 3) [m]."""
        everybody, time = self._api.vehicle.getIDList(), self._api.simulation.getTime()
        self._forget(everybody, time)
        due = self._due
        asked = [v for v in everybody if due.get(v, time) <= time] if due else list(everybody)
        flat = itertools.chain.from_iterable(map(self._position, asked))
        position = np.fromiter(flat, np.float64, 3 * len(asked)).reshape(-1, 3)
        ego = asked.index(self._ego)
        distance = np.hypot(position[:, 0] - position[ego, 0], position[:, 1] - position[ego, 1])
        near = distance <= self._radius
        if near.all():
            return asked, position
        waits = np.minimum((distance - self._radius) / (2.0 * TOP_SPEED), LONGEST_WAIT)
        for i in np.flatnonzero(~near).tolist():
            due[asked[i]] = time + float(waits[i])
        return [asked[i] for i in np.flatnonzero(near).tolist()], position[near]

    def _forget(self, everybody: Sequence[str], time: float) -> None:
        """Leave behind what cannot be relied on: after a jump of the ego or of time, and about who has gone."""
        elapsed, here = time - self._time, self._position(self._ego)
        moved = math.hypot(here[0] - self._ego_at[0], here[1] - self._ego_at[1])
        self._time, self._ego_at = time, (here[0], here[1])
        if elapsed < 0.0 or not moved <= TOP_SPEED * elapsed + 1.0:
            self._due.clear()
        for vehicle in self._api.simulation.getEndingTeleportIDList():
            self._due.pop(vehicle, None)
        if len(self._due) > 2 * len(everybody) + 100:
            self._due = {v: self._due[v] for v in everybody if v in self._due}
