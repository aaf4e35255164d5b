"""Keeping vehicles in their lanes."""

from collections.abc import Collection, Iterable

from fogsim.traffic.sumo.claims import LANE_CHANGE_MODE, Claims
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.roster import Roster

_NO_LANE_CHANGES = 0


class LaneKeeping:
    """Keeps some vehicles in their lanes."""

    def __init__(self, api: Api, vehicles: Iterable[str], roster: Roster, session: str) -> None:
        self._wanted = frozenset(vehicles)
        self._modes = Claims(api, LANE_CHANGE_MODE, session)
        self._kept: set[str] = set()
        self._roster = roster
        # Vehicles that are there already keep the owner's lane changing.
        _, self._mark = roster.entered_since(0)

    def update(self) -> None:
        """Forbid lane changes to vehicles that have entered the road."""
        new, self._mark = self._roster.entered_since(self._mark)
        for vehicle in self._wanted.intersection(new) if new else ():
            self._modes.claim(vehicle, _NO_LANE_CHANGES)
            self._kept.add(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Let vehicles change lanes again as they did before."""
        for vehicle in self._kept.intersection(present):
            self._modes.withdraw(vehicle)
        self._kept.clear()
