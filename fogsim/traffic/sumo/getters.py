"""SUMO's getters without detours."""

import sys
from collections.abc import Callable, Mapping
from typing import Any

from fogsim.traffic.sumo.link import Api

Getter = Callable[..., Any]
"""From a vehicle's id, and what else SUMO asks for, to the answer."""


def getter(api: Api, domain: str, name: str) -> Getter:
    """One getter, as directly as it can be called.

    libsumo's Python functions only pass their arguments on to compiled ones, which costs as much as the answer; where
    the compiled function is at hand it is taken itself. It names no leader as ``("", -1)`` instead of None.

    Parameters
    ----------
    api : Api
        libsumo or a connection of traci.
    domain : str
        ``vehicle``, ``simulation``, ``lane``, …
    name : str
        Name of the getter.
    """
    compiled = sys.modules.get(f"{getattr(api, '__name__', '')}._libsumo")
    found: Getter = getattr(compiled, f"{domain}_{name}", None) or getattr(getattr(api, domain), name)
    return found


def vehicle_getter(api: Api, name: str) -> Getter:
    """Getter of the domain ``vehicle``; see `getter`."""
    return getter(api, "vehicle", name)


def subscribed(api: Api, names: Mapping[str, int]) -> tuple[Getter, ...]:
    """Getters of the domain ``simulation`` whose answers SUMO sends with each step, so that asking sends no message.

    Parameters
    ----------
    api : Api
        A connection of traci.
    names : mapping from str to int
        Names of getters, and the numbers of their variables in SUMO's TraCI protocol.
    """
    simulation = api.simulation
    simulation.subscribe(tuple(names.values()))

    def reader(name: str, variable: int) -> Getter:
        def read() -> Any:
            try:
                return simulation.getSubscriptionResults()[variable]
            except (AttributeError, KeyError):
                # A simulation that is loaded anew has forgotten what was subscribed, and
                # traci stumbles over a connection that was closed; its getters tell it.
                return getattr(simulation, name)()

        return read

    return tuple(reader(name, variable) for name, variable in names.items())
