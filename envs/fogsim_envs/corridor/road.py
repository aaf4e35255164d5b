"""A road with message signs, as far as it is known before any vehicle drives on it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.scenario import Scenario, build
from fogsim.scenario.road_sections import road_sections, stations
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.road.network import read_net, route_axis
from fogsim.values.road import LaneKind


class SignedRoad(NamedTuple):
    """A road with message signs."""

    starts: tuple[float, ...]  # Places of the signs along the road [m]
    axis: NDArray[np.float64]  # (m, 3): Polyline along it [m]
    length: float  # Its length [m]
    lanes: int  # Lanes for vehicles where it begins


def signed_road(scenario: Scenario) -> SignedRoad:
    """The road along which a scenario without an ego has its signs."""
    if scenario.traffic.has_ego or scenario.drivers.advised != "signs":
        raise InputError(
            "FogCorridor: expected a scenario with traffic.ego: none and drivers.advised: signs, got "
            f"traffic.ego: {scenario.traffic.ego} and drivers.advised: {scenario.drivers.advised}"
        )
    setup = build.traffic_setup(scenario)
    net = setup.net if setup.config is None else configured_files(setup.config)[0]
    if net is None:
        raise InputError("FogCorridor: expected a scenario with a road network, got none")
    roads = read_net(net)
    axis, _ = route_axis(roads, scenario.traffic.along)
    length = float(stations(axis)[-1])
    starts = tuple(section.start for section in road_sections(scenario, length))
    if not starts:
        raise InputError(f"FogCorridor: no sign of drivers.signs stands on the road of {length:.0f} m")
    lanes = sum(roads.lanes[place].kind is LaneKind.CARRIAGEWAY for place in roads.edges[scenario.traffic.along[0]])
    return SignedRoad(starts, axis, length, max(lanes, 1))
