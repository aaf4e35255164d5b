"""Parameters of SUMO's lane-change models that are turned to one value for some drivers, and back."""

import contextlib
from collections.abc import Collection, Iterable, Sequence

from fogsim.traffic.sumo.claims import Attribute, Claims
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
        for vehicle in on:
            self.turn_on(vehicle)

    def restart(self, vehicles: Iterable[str], present: Collection[str]) -> None:
        """Turn it off for vehicles that have entered or left."""
        for vehicle in self._turned.intersection(vehicles) if self._turned else ():
            if vehicle in present:
                self.turn_off(vehicle)
            else:
                self._turned.remove(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Turn it off for everyone."""
        self.restart(tuple(self._turned), present)
