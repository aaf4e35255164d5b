"""Parameters of SUMO's lane-change models that are turned to one value for some drivers, and back."""

import contextlib
import math
from collections.abc import Collection, Iterable, Mapping, Sequence

from fogsim.traffic.sumo.claims import Attribute, Claims, SessionValues
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.traci_link import load_traci


def refusal_of(api: Api) -> type[Exception]:
    """The error of a simulation that refuses a call, as it does for parameters that a model does not have."""
    # A connection of traci has no errors of its own; both modules do.
    error: type[Exception] = getattr(api, "TraCIException", None) or load_traci().TraCIException
    return error


class LaneChangeSwitch:
    """Turns one parameter to one value and back; a driver whose model does not have it stays as he is."""

    def __init__(self, api: Api, attribute: Attribute, value: float, session: str) -> None:
        self._claims = Claims(api, attribute, session)
        self._value = value
        self._refusal = refusal_of(api)
        self._turned: set[str] = set()

    def turn_on(self, vehicle: str) -> None:
        """Turn it on for a vehicle on the road; nothing is asked of SUMO if it is on already."""
        if vehicle not in self._turned:
            self._turned.add(vehicle)
            with contextlib.suppress(self._refusal):
                self._claims.claim(vehicle, self._value)

    def turn_off(self, vehicle: str) -> None:
        """Turn it off for a vehicle on the road; nothing is asked of SUMO if it is off already."""
        if vehicle in self._turned:
            self._turned.remove(vehicle)
            self._claims.withdraw(vehicle)

    def decide(self, vehicles: Sequence[str], on: Collection[str]) -> None:
        """Turn it on for some of those for whom it is decided again, and off for the others."""
        for vehicle in self._turned.intersection(vehicles).difference(on) if self._turned else ():
            self.turn_off(vehicle)
        for vehicle in [v for v in on if v not in self._turned]:
            self.turn_on(vehicle)

    def restart(self, vehicles: Iterable[str], present: Collection[str]) -> None:
        """Turn it off for vehicles that have entered: who comes back from a teleport has it on still."""
        for vehicle in self._turned.intersection(vehicles).intersection(present) if self._turned else ():
            self.turn_off(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Turn it off for everyone."""
        self.restart(tuple(self._turned), present)
        self._turned.clear()


_NOT_SEEN = math.inf
_IGNORED = "junctionModel.ignoreIDs"
_OWN = "own"


class _IgnoredFoes:
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
    """Whom drivers do not react to at junctions: who is out of sight, or in view only just now."""

    def __init__(self, api: Api, session: str, reaction_time: float) -> None:
        self._ignored = _IgnoredFoes(api, session)
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
        """Decide to whom of those near a driver reacts; return whether one of them is soon reacted to."""
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
