"""A SUMO simulation that its owner has started, steps and ends."""

import contextlib
from collections.abc import Sequence
from dataclasses import replace

from fogsim.errors import InputError, SimulationError, shown
from fogsim.traffic.setup import ANY_EGO, TrafficSetup
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo.link import Api, translated_errors
from fogsim.traffic.sumo.loaded_files import check_microscopic, describe_seen
from fogsim.traffic.sumo.traci_link import load_traci
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.values import Command, Unplayed


class _AttachedLink:
    """A simulation that runs already, and is neither stepped nor ended by this link."""

    shared = True

    def __init__(self, api: Api) -> None:
        if not hasattr(api, "simulationStep"):
            raise InputError(f"expected libsumo, traci or a connection of traci, got {shown(api)}")
        self._api = api
        # A connection of traci does not say what it is; both modules do.
        inside = bool(getattr(api, "isLibsumo", bool)())
        self.remote = not inside
        self._library = load_libsumo() if inside else load_traci()
        if inside and not api.isLoaded():
            raise SimulationError("no simulation runs in libsumo: call libsumo.start first")

    def begin(self, arguments: Sequence[str]) -> Api:  # noqa: ARG002 - the simulation has its own
        """Take the simulation as it is; see `SumoLink.begin`."""
        return self._api

    def step(self) -> None:
        """Do nothing: the simulation's owner steps it."""

    def end(self) -> None:
        """Do nothing: the simulation is its owner's."""

    def warnings(self) -> tuple[str, ...]:
        """Nothing: the owner of the simulation reads them."""
        return ()

    def translated_errors(self) -> contextlib.AbstractContextManager[None]:
        """Turn the loss of the simulation into an error of ours; see `SumoLink.translated_errors`."""
        return translated_errors(self._library, "to which FogSim is attached")


class AttachedTraffic(SumoTraffic):
    """SUMO traffic whose owner commands the steps: `obey` before each, `look` after it.

    Only the setup's network is used. SimulationError if no microscopic simulation is running.
    """

    def __init__(self, setup: TrafficSetup, api: Api) -> None:
        if setup.ego is None:
            raise InputError("attaching to a simulation needs an ego vehicle in it, and traffic.ego is none")
        if setup.ego == ANY_EGO:
            raise InputError(f"ego: {ANY_EGO}: FogSim can choose only in its own simulation; name a vehicle")
        self._attached = _AttachedLink(api)
        self._api = api
        with self._attached.translated_errors():
            check_microscopic(api)
        self.ego = setup.ego
        self._seen: set[str] = set()
        super().__init__(replace(setup, step_length=step_length(api)), self._attached)

    def ego_is_there(self) -> bool:
        """True while the ego is on the road."""
        with self._attached.translated_errors():
            present = self._api.vehicle.getIDList()
        self._seen.update(present)
        return self.ego in present

    def obey(self, command: Command) -> None:
        """Put a command in force for the next step; see `SumoTraffic.obey`."""
        # The owner may have taken a vehicle away since the look, or loaded another simulation.
        with self._attached.translated_errors():
            self._running.roster.check_count()
        super().obey(command)

    def look(self) -> float:
        """Read the last step; return its time [s]. An ego that arrives is gone at once."""
        time = super().look()
        self._arrived = False
        return time

    def unplayed(self) -> Unplayed:
        """What of the script has not been played; see `Traffic.unplayed`."""
        return self._unplayed(self._seen)

    def absence(self) -> str:
        """Say that the ego has not been on the road so far, and who has."""
        with contextlib.suppress(SimulationError), self._attached.translated_errors():
            if self.ego in self._api.person.getIDList():
                return f"the ego {self.ego!r} did not appear while FogSim was attached: it is a person; name a vehicle"
        return f"the ego {self.ego!r} did not appear while FogSim was attached; {describe_seen(self.ego, self._seen)}"


def step_length(api: Api) -> float:
    """Step of a simulation that runs [s]."""
    with _AttachedLink(api).translated_errors():
        return float(api.simulation.getDeltaT())
