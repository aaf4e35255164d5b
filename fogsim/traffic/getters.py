"""SUMO's getters without detours."""

import sys
from collections.abc import Callable
from typing import Any

from fogsim.traffic.link import Api

Getter = Callable[[str], Any]
"""From a vehicle's id to what is asked."""


def vehicle_getter(api: Api, name: str) -> Getter:
    """Getter of the domain ``vehicle``, as directly as it can be called.

    libsumo's Python functions only pass their arguments on to compiled ones, which costs as much as the answer; where
    the compiled function is at hand it is taken itself.

    Parameters
    ----------
    api : Api
        libsumo or a connection of traci.
    name : str
        Name of the getter.
    """
    compiled = sys.modules.get(f"{getattr(api, '__name__', '')}._libsumo")
    found: Getter = getattr(compiled, f"vehicle_{name}", None) or getattr(api.vehicle, name)
    return found
