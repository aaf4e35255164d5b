"""A SUMO simulation whose steps somebody else commands."""

import contextlib
from collections.abc import Sequence

from fogsim.traffic.link import Api, told_errors
from fogsim.traffic.sumo_library import load_libsumo
from fogsim.traffic.traci_link import load_traci


class AttachedLink:
    """A simulation that runs already, and is neither stepped nor ended by this link.

    Parameters
    ----------
    api : module or traci.Connection
        libsumo, traci, or one connection of traci.
    """

    def __init__(self, api: Api) -> None:
        self._api = api
        # A connection of traci does not say what it is; both modules do.
        inside = bool(getattr(api, "isLibsumo", bool)())
        self.distant = not inside
        self._library = load_libsumo() if inside else load_traci()

    def begin(self, arguments: Sequence[str]) -> Api:  # noqa: ARG002 - the simulation has its own
        """Take the simulation as it is; see `SumoLink.begin`."""
        return self._api

    def step(self) -> None:
        """Do nothing: the simulation's owner steps it."""

    def end(self) -> None:
        """Do nothing: the simulation is its owner's."""

    def watched(self) -> contextlib.AbstractContextManager[None]:
        """Turn the loss of the simulation into an error of ours; see `SumoLink.watched`."""
        return told_errors(self._library, "to which FogSim is attached")
