"""Parameters of SUMO's lane-change models that are turned to one value for some drivers, and back."""

import contextlib
from collections.abc import Collection, Iterable

from fogsim.traffic.sumo.claims import Attribute, Claims
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.traci_link import load_traci


def refusal_of(api: Api) -> type[Exception]:
    """The error of a simulation that refuses a call, as it does for parameters that a model does not have.

    Parameters
    ----------
    api : Api
        The simulation.
    """
    # A connection of traci has no errors of its own; both modules do.
    error: type[Exception] = getattr(api, "TraCIException", None) or load_traci().TraCIException
    return error


class LaneChangeSwitch:
    """Turns one parameter to one value and back; a driver whose model does not have it stays as he is.

    Parameters
    ----------
    api : Api
        The simulation.
    attribute : Attribute
        The parameter.
    value : float
        Its value while it is turned on.
    session : str
        Name of the session.
    """

    def __init__(self, api: Api, attribute: Attribute, value: float, session: str) -> None:
        self._claims = Claims(api, attribute, session)
        self._value = value
        self._refusal = refusal_of(api)
        self._turned: set[str] = set()

    def turn(self, vehicle: str, on: bool) -> None:
        """Turn it on or off; nothing is asked of SUMO if it is so already.

        Parameters
        ----------
        vehicle : str
            Id of a vehicle on the road.
        on : bool
            Whether the value is to hold.
        """
        if on and vehicle not in self._turned:
            self._turned.add(vehicle)
            with contextlib.suppress(self._refusal):
                self._claims.claim(vehicle, self._value)
        elif not on and vehicle in self._turned:
            self._turned.remove(vehicle)
            self._claims.withdraw(vehicle)

    def turn_off(self, vehicles: Iterable[str], present: Collection[str]) -> None:
        """Turn it off for some vehicles, and forget those that have left.

        Parameters
        ----------
        vehicles : iterable of str
            Their ids.
        present : collection of str
            Vehicles on the road.
        """
        for vehicle in self._turned.intersection(vehicles):
            if vehicle in present:
                self.turn(vehicle, False)
            else:
                self._turned.remove(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Turn it off for everybody.

        Parameters
        ----------
        present : collection of str
            Vehicles on the road.
        """
        self.turn_off(tuple(self._turned), present)
