"""How a SUMO simulation is reached: in this process, or over a connection. Both offer the same calls."""

import contextlib
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any, Protocol

from fogsim.errors import SimulationError

Api = Any
"""The domains of SUMO's TraCI (``vehicle``, ``simulation``, ``lane``, …), as libsumo and traci both offer them.

Neither has types; every use is inside the traffic stage.
"""


class SumoLink(Protocol):
    """A SUMO simulation that can be begun, stepped and ended.

    It is `remote` if every call is a message to another process, so that few calls must do, and `shared` if others may
    command it too, and take vehicles away between two calls.
    """

    @property
    def remote(self) -> bool:
        """See the class."""

    @property
    def shared(self) -> bool:
        """See the class."""

    def begin(self, arguments: Sequence[str]) -> Api:
        """Start SUMO with arguments of its command line, or load it again if this link has begun it before."""

    def step(self) -> None:
        """Move the simulation by one step."""

    def end(self) -> None:
        """End the simulation, or leave it; ending twice is allowed."""

    def warnings(self) -> Sequence[str]:
        """What SUMO has warned of until its `end`; empty where its owner reads that."""

    def translated_errors(self) -> contextlib.AbstractContextManager[None]:
        """Block in which a simulation that is lost or refuses a call becomes a `SimulationError`."""


@contextlib.contextmanager
def translated_errors(library: ModuleType, where: str) -> Iterator[None]:
    """Block in which the errors of libsumo or traci become a `SimulationError`."""
    try:
        yield
    except (library.FatalTraCIError, ConnectionError) as error:
        raise SimulationError(
            f"SUMO {where} is lost: {str(error).rstrip('.')}; it has ended, was closed, or the connection broke"
        ) from error
    except library.TraCIException as error:
        raise SimulationError(f"SUMO {where} refused: {error}") from error


UNKNOWN = -(2.0**30)
"""SUMO's answer where there is none: the place on a lane, slope and allowed speed of a vehicle off the lanes."""

Getter = Callable[..., Any]
"""From a vehicle's id, and what else SUMO asks for, to the answer."""


def getter(api: Api, domain: str, name: str) -> Getter:
    """One getter, as directly as it can be called.

    libsumo's Python functions only pass their arguments on to compiled ones, which costs as much as the answer; where
    the compiled function is at hand it is taken itself. It names no leader as ``("", -1)`` instead of None.
    """
    compiled = sys.modules.get(f"{getattr(api, '__name__', '')}._libsumo")
    found: Getter = getattr(compiled, f"{domain}_{name}", None) or getattr(getattr(api, domain), name)
    return found


def vehicle_getter(api: Api, name: str) -> Getter:
    """Getter of the domain ``vehicle``; see `getter`."""
    return getter(api, "vehicle", name)


def is_off_lanes(api: Api, vehicle: str) -> bool:
    """Whether a vehicle on the road is on no lane: parked next to it, or put there; see `TrafficState.off_lanes`."""
    return not api.vehicle.getLaneID(vehicle)


def shared_type(api: Api, vehicle: str) -> str:
    """Type of a vehicle as others may have it.

    With the first change of what its type says a vehicle gets a type of its own, with its id after the name. SUMO
    deletes that with the first vehicle that has it, though it be made for a search alone, and breaks down then.
    """
    return str(api.vehicle.getTypeID(vehicle)).removesuffix(f"@{vehicle}")


def edge_length(api: Api, edge: str) -> float:
    """Length of an edge [m]."""
    return float(api.lane.getLength(f"{edge}_0"))


def inner_lanes(links: Getter, lane: str) -> Iterator[str]:
    """A lane inside a junction and those there that follow it; `links` is SUMO's getter of a lane's links."""
    while lane:
        yield lane
        lane = next((link[4] for link in links(lane)), "")


def has_lane(api: Api, vehicle: str, lanes: int) -> bool:
    """Whether a vehicle could go so many lanes to the left, negative to the right, where it is."""
    if is_off_lanes(api, vehicle):
        return False
    edge, lane = str(api.vehicle.getRoadID(vehicle)), int(api.vehicle.getLaneIndex(vehicle)) + lanes
    # Lanes of a junction say nothing about those behind it, where SUMO makes the change.
    return lane >= 0 and (edge.startswith(":") or lane < int(api.edge.getLaneNumber(edge)))


def subscribed(api: Api, names: Mapping[str, int]) -> tuple[Getter, ...]:
    """Getters of the domain ``simulation`` whose answers SUMO sends with each step, so that asking sends no message."""
    simulation = api.simulation
    simulation.subscribe(tuple(names.values()))

    def reader(name: str, variable: int) -> Getter:
        def read() -> Any:
            try:
                return simulation.getSubscriptionResults()[variable]
            except (AttributeError, KeyError):
                # A simulation that is loaded again has forgotten what was subscribed, and
                # traci fails on a closed connection; its getters raise.
                return getattr(simulation, name)()

        return read

    return tuple(reader(name, variable) for name, variable in names.items())


_VARIABLES = {
    "getSpeed": 0x40,
    "getTypeID": 0x4F,
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
