"""Which vehicles are read: those near the ego, without asking all where they are in every step, or everyone."""

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo.roster import MAX_RELATIVE_ACCELERATION, Roster, UpdateSchedule

_TOP_SPEED = 100.0
"""Speed that no road vehicle exceeds [m/s]."""

_MAX_WAIT = 1.0
"""Time after which a vehicle's distance is computed again in any case [s], should somebody have moved it by hand."""


class AllVehicles:
    """Finds everyone on the road."""

    def __init__(self, api: Api, roster: Roster) -> None:
        self._position = vehicle_getter(api, "getPosition3D")
        self._roster = roster
        self._ids: tuple[str, ...] = ()
        self._mark = self._removals = 0

    def find(self) -> tuple[tuple[str, ...], NDArray[np.float64]]:
        """Ids in SUMO's order and positions (n, 3) [m]; the ids are the same object while no one comes or goes."""
        roster = self._roster
        roster.update()
        new, self._mark = roster.entered_since(self._mark)
        if new or self._removals != roster.removals:
            self._removals = roster.removals
            self._ids = tuple(sorted(roster.present))
        return self._ids, positions_of(self._ids, self._position)


class NearbyVehicles:
    """Finds the vehicles near the ego (`radius` [m]); one far away is asked again only when it could be near.

    Distances of those near are computed only once one of them could be far.
    """

    def __init__(self, api: Api, ego: str, radius: float, roster: Roster | None = None) -> None:
        self._ego = ego
        self._radius = radius
        self._position, self._place = vehicle_getter(api, "getPosition3D"), vehicle_getter(api, "getPosition")
        self._speed = vehicle_getter(api, "getSpeed")
        self._roster = Roster(api) if roster is None else roster
        self._far = UpdateSchedule(float(api.simulation.getDeltaT()), self._roster.time)
        self._near: tuple[str, ...] = ()
        self._mark = self._removals = 0
        self._last_place = (-math.inf, math.inf, math.inf)
        self._all_near_until = -math.inf

    def find(self) -> tuple[tuple[str, ...], NDArray[np.float64]]:
        """Ids near the ego, with its own, in SUMO's order (the same object if alike), and positions (n, 3) [m]."""
        roster = self._roster
        roster.update()
        here = self._position(self._ego)
        # After a jump of the ego or of time no vehicle can be relied on to be still far, or still near.
        has_jumped = self._has_jumped(here)
        far = self._all_others() if has_jumped else self._due()
        if self._removals != roster.removals:
            self._removals = roster.removals
            self._set_near([v for v in self._near if v in roster.present])
        # Plain numbers: mostly some ten are due, for which arrays would cost three times as much.
        distances = list(map(math.dist, map(self._place, far), itertools.repeat(here[:2])))
        come_near = self._schedule_far(far, distances) if far else ()
        if come_near:
            self._set_near([*self._near, *come_near])
        position = positions_of(self._near, self._position)
        if has_jumped or come_near or roster.time >= self._all_near_until:
            position = self._drop_far(position, here)
        return self._near, position

    def _drop_far(self, position: NDArray[np.float64], here: Sequence[float]) -> NDArray[np.float64]:
        """Schedule those that have become far, and give the others' positions back."""
        distances = np.hypot(position[:, 0] - here[0], position[:, 1] - here[1]).tolist()
        if max(distances) > self._radius:
            position = position[[distance <= self._radius for distance in distances]]
            self._set_near(self._schedule_far(self._near, distances))
            distances = [distance for distance in distances if distance <= self._radius]
        wait = (self._radius - max(distances)) / self._highest_rate()
        self._all_near_until = self._roster.time + min(wait, _MAX_WAIT)
        return position

    def _set_near(self, near: Sequence[str]) -> None:
        self._near = tuple(sorted(near))

    def _schedule_far(self, vehicles: Sequence[str], distances: Sequence[float]) -> list[str]:
        """Those near; the others wait until they could have come near."""
        rate, radius, now = self._highest_rate(), self._radius, self._roster.time
        both, farthest = list(zip(vehicles, distances, strict=True)), radius + rate * _MAX_WAIT
        self._far.add([v for v, away in both if away >= farthest], now + _MAX_WAIT)
        waits = {v: (away - radius) / rate for v, away in both if radius < away < farthest}
        self._far.add_each(waits, waits.values(), now)
        return [v for v, away in both if away <= radius]

    def _highest_rate(self) -> float:
        """How fast a distance from the ego changes at most, within the longest wait [m/s]."""
        # To read the speeds of the vehicles would cost more than to look again sooner.
        return _TOP_SPEED + float(self._speed(self._ego)) + MAX_RELATIVE_ACCELERATION * _MAX_WAIT

    def _has_jumped(self, here: Sequence[float]) -> bool:
        """True after a jump of the ego or of time, and at the first look."""
        time, x, y = self._last_place
        now = self._roster.time
        self._last_place = (now, here[0], here[1])
        return now < time or not math.hypot(here[0] - x, here[1] - y) <= _TOP_SPEED * (now - time) + 1.0

    def _all_others(self) -> list[str]:
        self._far.clear()
        self._far.pop_due(self._roster.time)
        _, self._mark = self._roster.entered_since(self._mark)
        return sorted(self._roster.present.difference(self._near))

    def _due(self) -> list[str]:
        """Vehicles that may have come near, and those new on the road."""
        present = self._roster.present
        due = [v for v in self._far.pop_due(self._roster.time) if v in present]
        new, self._mark = self._roster.entered_since(self._mark)
        if not new:
            return due
        return [*due, *(v for v in self._far.unscheduled(new) if v in present and v not in {*self._near, *due})]


def positions_of(vehicles: Sequence[str], position: Callable[[str], Sequence[float]]) -> NDArray[np.float64]:
    """Positions of vehicles (n, 3) [m]."""
    flat = itertools.chain.from_iterable(map(position, vehicles))
    try:
        return np.fromiter(flat, np.float64, 3 * len(vehicles)).reshape(-1, 3)
    except ValueError:
        # Far from all lanes a vehicle has no height.
        return np.array([(*position(vehicle), 0.0)[:3] for vehicle in vehicles])
