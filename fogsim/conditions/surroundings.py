"""Signals of what is around the ego: light, road, traffic, and whether its sensors work."""

import numpy as np
from numpy.typing import NDArray

from fogsim.conditions.moment import EGO, Moment
from fogsim.conditions.signal import Kind, Need, Signal
from fogsim.values import FogBank

_REACH = 250.0
"""Distance ahead and behind in which vehicles count for the traffic density [m]."""

_EGO = frozenset({Need.EGO})


def is_inside(bank: FogBank, position: NDArray[np.float64]) -> bool:
    """Whether a position (3,) [m] is between the beginning and the end of a bank."""
    east, north, _ = position
    along = (east - bank.origin[0]) * bank.axis[0] + (north - bank.origin[1]) * bank.axis[1]
    return bool(bank.start <= along <= bank.end)


def _density(moment: Moment) -> float | None:
    step = moment.ego_step
    if step is None:
        return None
    traffic, ego = step.traffic, step.ego
    reach = min(_REACH, step.reading_radius)
    apart = traffic.position[:, :2] - traffic.position[ego, :2]
    is_near = np.hypot(apart[:, 0], apart[:, 1]) <= reach
    is_along = np.cos(traffic.heading - traffic.heading[ego]) > 0.0
    return float(np.count_nonzero(is_near & is_along) - 1) / (2.0 * reach)


def _is_in_any_bank(moment: Moment) -> bool | None:
    row, fog = moment.row(EGO), moment.step.truth.fog
    if row is None or fog is None:
        return None
    return any(is_inside(bank, moment.traffic.position[row]) for bank in fog.banks)


OF_SURROUNDINGS = {
    "light": Signal(
        "horizontal illuminance of the sky: 10 000 lx by day, below 1 lx at night",
        lambda m: m.step.truth.illuminance,
        unit="lx",
        least=0.0,
    ),
    "ego.curvature": Signal(
        "curvature of the road, over 50 m about the ego: 0 where it is straight, 1 km^-1 for a radius of 1000 m",
        lambda m: m.curvature(EGO),
        unit="m^-1",
        shown_unit="km^-1",
        least=0.0,
        needs=_EGO,
    ),
    "ego.traffic_density": Signal(
        f"other vehicles in the ego's direction within {_REACH:g} m of it, on all lanes, per length of road",
        _density,
        unit="veh/m",
        shown_unit="veh/km",
        least=0.0,
        needs=_EGO,
    ),
    "ego.has_leader": Signal(
        "whether a vehicle is ahead of the ego",
        lambda m: None if m.ego_step is None else m.ego_step.leader is not None,
        Kind.FLAG,
        needs=_EGO,
    ),
    "ego.sensor_fault": Signal(
        "whether a fault of the ego's sensors is in force",
        lambda m: None if m.ego_step is None else bool(m.step.truth.faults),
        Kind.FLAG,
        needs=_EGO,
    ),
    "fog.in_bank": Signal("whether the ego is in any of the fog banks", _is_in_any_bank, Kind.FLAG, needs=_EGO),
}
"""By name."""
