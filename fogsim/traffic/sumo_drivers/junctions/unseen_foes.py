"""Making drivers ignore vehicles and persons at junctions until they have seen them, by what SUMO offers for it."""

import math
from collections.abc import Collection, Iterable, Mapping

from fogsim.traffic.sumo.claims import SessionValues
from fogsim.traffic.sumo.link import Api

_NOT_SEEN = math.inf
_IGNORED = "junctionModel.ignoreIDs"
_OWN = "own"


class IgnoredFoes:
    """Sets whom a driver does not yield to at a junction, outside it or on it, whoever has the right of way.

    A driver ignores what any session has it ignore, and whom it ignored by itself before.
    """

    def __init__(self, api: Api, session: str) -> None:
        self._vehicles = api.vehicle
        self._session = session
        self._values = SessionValues[list[str]](api, "ignoredFoes")

    def ignore(self, vehicle: str, foes: Collection[str]) -> None:
        """Let a driver ignore exactly these, as far as this session goes."""
        values = self._values.read(vehicle)
        if not foes and self._session not in values:
            return
        if not values:
            values[_OWN] = self._vehicles.getParameter(vehicle, _IGNORED).split()
        values.pop(self._session, None)
        if foes:
            values[self._session] = sorted(foes)
        ignored = set().union(*values.values())
        self._vehicles.setParameter(vehicle, _IGNORED, " ".join(sorted(ignored)))
        self._values.write(vehicle, values if len(values) > 1 else {})


class UnseenFoes:
    """Whom drivers do not react to at junctions: who is out of sight, and who has come into view only just now.

    Takes `reaction_time` [s].
    """

    def __init__(self, api: Api, session: str, reaction_time: float) -> None:
        self._ignored = IgnoredFoes(api, session)
        self._reaction_time = reaction_time
        self._since: dict[str, dict[str, float]] = {}
        self._left: set[str] = set()

    def of(self, driver: str) -> Collection[str]:
        """Those to whom a driver does not react."""
        return self._since.get(driver, ())

    @property
    def drivers(self) -> Collection[str]:
        """Drivers who do not react to some foe."""
        return self._since.keys()

    def decide(self, driver: str, is_seen: Mapping[str, bool], now: float) -> bool:
        """Decide to whom of those near a driver reacts; to all others he does.

        Returns whether one of them has come into view and is soon reacted to. Takes `now` [s].
        """
        before = self._since.get(driver, {})
        unseen: dict[str, float] = {}
        for foe, seen in is_seen.items():
            if not seen:
                unseen[foe] = _NOT_SEEN
            elif foe in before and now - (since := min(before[foe], now)) < self._reaction_time:
                unseen[foe] = since
        if unseen.keys() != before.keys():
            self._ignored.ignore(driver, unseen.keys())
        if unseen:
            self._since[driver] = unseen
        elif before:
            del self._since[driver]
        return any(since <= now for since in unseen.values())

    def forget(self, gone: Iterable[str], new: Iterable[str]) -> None:
        """Forget vehicles that have left the road."""
        self._left.update([v for v in gone if self._since.pop(v, None)])
        # One that comes back from a teleport still ignores whom it ignored.
        for driver in self._left.intersection(new) if self._left else ():
            self._left.discard(driver)
            self._ignored.ignore(driver, ())

    def release(self, present: Collection[str]) -> None:
        """Let everyone react to everyone again."""
        for driver in self._since.keys() & set(present):
            self._ignored.ignore(driver, ())
        self._since.clear()
