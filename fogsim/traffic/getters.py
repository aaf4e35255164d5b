"""SUMO's getters without detours."""

import sys
from collections.abc import Callable
from typing import Any

from fogsim.traffic.link import Api

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
