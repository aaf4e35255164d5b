"""What is asked of SUMO for many vehicles in each step: by call, or by subscription, where asking sends no message."""

from collections.abc import Mapping, Sequence
from typing import Any

from fogsim.traffic.sumo.link import Api, Getter, vehicle_getter

_VARIABLES = {
    "getSpeed": 0x40,
    "getPosition3D": 0x39,
    "getAngle": 0x43,
    "getSignals": 0x5B,
    "getLaneID": 0x51,
    "getLanePosition": 0x56,
    "getLateralLanePosition": 0xB8,
    "getLeader": 0x68,
    "getNeighbors": 0xBF,
}
"""Getters, and their variables in SUMO's TraCI protocol."""


def vehicle_getters(
    api: Api, remote: bool, names: Sequence[str], arguments: Mapping[str, tuple[str, Any]] | None = None
) -> tuple[Getter, ...]:
    """Getters of the domain ``vehicle``, by subscription where every call is a message to another process."""
    if not remote:
        return tuple(vehicle_getter(api, name) for name in names)
    numbers = {name: _VARIABLES[name] for name in names}
    parameters = {numbers[name]: argument for name, argument in (arguments or {}).items()}
    subscription = _Subscription(api, tuple(numbers.values()), parameters)
    return tuple(subscription.getter(number) for number in numbers.values())


class _Subscription:
    """Variables of vehicles; each vehicle's are subscribed to when it is first asked for."""

    def __init__(self, api: Api, variables: tuple[int, ...], parameters: Mapping[int, tuple[str, Any]]) -> None:
        self._vehicles = api.vehicle
        self._results = api.vehicle.getSubscriptionResults
        self._variables = variables
        self._parameters = parameters

    def getter(self, variable: int) -> Getter:
        def read(vehicle: str, *_: Any) -> Any:
            results: Mapping[int, Any] = self._results(vehicle)
            if variable not in results:
                # SUMO adds them to what the user may have subscribed to.
                self._vehicles.subscribe(vehicle, self._variables, parameters=self._parameters)
                results = self._results(vehicle)
            return results[variable]

        return read
