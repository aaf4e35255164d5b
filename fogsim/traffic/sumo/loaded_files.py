"""What a running simulation reports about itself, and the roads and the ego's route in its files."""

import difflib
import math
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

from fogsim.errors import InputError, SimulationError, nearest_of, shown
from fogsim.traffic.road.configuration import NO_LANES, configured_files, is_true
from fogsim.traffic.road.demand import read_configured_demand, read_demand
from fogsim.traffic.road.map_cache import RoadMap
from fogsim.traffic.road.network import read_net, road_network
from fogsim.traffic.road.signs import sign_map
from fogsim.traffic.road.structures import structures
from fogsim.traffic.setup import TrafficSetup
from fogsim.traffic.sumo.link import Api
from fogsim.values import RoadNetwork, SignMap, Structure

CLOCK_TICK = 1e-3
"""Resolution of SUMO's clock [s]."""

_SHOWN = 8
"""Vehicles that a message names."""

_NEAREST = 3
"""Edges that a message names."""

_MOST_WARNINGS = 3
"""Warnings of SUMO's that a message repeats."""

LEFT_OUT = re.compile("ignor|discard|skipp", re.IGNORECASE)
"""What SUMO's warnings have in common that say which part of its files it does not use."""


def describe_seen(ego: str, seen: Collection[str]) -> str:
    """Say which vehicles there were instead of an ego that was not, those with a similar id first."""
    if not seen:
        return "no vehicle did: are there vehicles in its route or additional files?"
    near = difflib.get_close_matches(ego, sorted(seen), n=3, cutoff=0.5)
    some = [*near, *sorted(set(seen).difference(near))[: _SHOWN - len(near)]]
    others = f" and {len(seen) - len(some)} more" if len(seen) > len(some) else ""
    return f"those that did: {', '.join(some)}{others}"


def describe_warnings(warnings: Sequence[str], ego: str | None) -> str:
    """What SUMO has warned of, in one line: of the ego if it is named, otherwise of all; empty without warnings."""
    distinct = list(dict.fromkeys(warnings))
    shown_warnings = [one for one in distinct if ego is not None and f"'{ego}'" in one] or distinct
    more = f" and {len(shown_warnings) - _MOST_WARNINGS} more" if len(shown_warnings) > _MOST_WARNINGS else ""
    return f"SUMO warned: {' '.join(shown_warnings[:_MOST_WARNINGS])}{more}" if shown_warnings else ""


def end_time(api: Api) -> float:
    """Time at which a simulation ends by its own options [s]; ``inf`` if they do not say."""
    end = float(api.simulation.getEndTime())
    return end if end >= 0.0 else math.inf


def check_microscopic(api: Api) -> None:
    """Raise SimulationError if a simulation is mesoscopic."""
    if is_true(api.simulation.getOption("mesosim")):
        raise SimulationError(f"SUMO runs with mesosim: {NO_LANES}")


def check_step_length(api: Api, step_length: float) -> None:
    """Hold a simulation to the step that FogSim counts with (`step_length` [s])."""
    found = api.simulation.getDeltaT()
    if abs(found - step_length) > 1e-3 * CLOCK_TICK:
        raise SimulationError(
            f"SUMO moves in steps of {found:g} s, but clocks.traffic_step_s is {step_length:g}: "
            f"start SUMO with --step-length {step_length:g}, or set clocks.traffic_step_s={found:g}"
        )


def loaded_net(api: Api) -> Path:
    """Network file that a running simulation has loaded."""
    path = Path(api.simulation.getOption("net-file"))
    if not path.is_file():
        raise SimulationError(
            f"SUMO says that its network is {str(path)!r}, and there is no such file as seen from {Path.cwd()}: "
            "name the file (net)"
        )
    return path


def loaded_additional(api: Api) -> tuple[Path, ...]:
    """Additional files of a running simulation, as far as they are here to be read."""
    names = api.simulation.getOption("additional-files").split(",")
    return tuple(path for name in names if (path := Path(name.strip())).is_file())


class _PlannedWay(NamedTuple):
    """Where the ego drives."""

    net: Path  # Network
    additional: tuple[Path, ...]  # Files with what stands next to the road
    edges: tuple[str, ...]  # Ids of the edges that the ego drives on


def planned_way(setup: TrafficSetup) -> _PlannedWay | None:
    """Look for the ego's way in the files; None where it is not written out in them."""
    if setup.ego is None:
        return None
    if setup.config is None:
        if setup.net is None:
            return None
        net, additional = setup.net, setup.additional
        demand = read_demand((*setup.additional, *setup.routes), (setup.ego,))
    elif setup.routes or setup.additional:
        return None
    else:
        try:
            net, additional = configured_files(setup.config)
            demand = read_configured_demand(setup.config, (setup.ego,))
        except InputError:
            return None  # SUMO reports what is wrong with it
        additional = tuple(path for path in additional if path.is_file())
        if not net.is_file():
            return None
    way = demand.routes.get(setup.ego)
    return None if way is None else _PlannedWay(net, additional, way.edges)


class LoadedRoads:
    """Roads, signs and what stands next to the roads, by files that are named or that a simulation has loaded."""

    def __init__(self, net: Path | None, additional: tuple[Path, ...]) -> None:
        self._file, self._additional = net, additional
        self._net: RoadMap | None = None
        self._structures: tuple[Structure, ...] | None = None
        self._known: tuple[tuple[str, ...], tuple[RoadNetwork, SignMap]] | None = None

    def plan(self, setup: TrafficSetup) -> tuple[RoadNetwork, SignMap] | None:
        """Roads and signs along the ego's written way; see `Traffic.planned_network`."""
        planned = planned_way(setup)
        if planned is None:
            return None
        net = self._net = read_net(planned.net)
        if not net.edges.keys() >= set(planned.edges):
            return None
        self._structures = structures(planned.additional)
        roads = road_network(net, planned.edges, self._structures), sign_map(net, planned.additional)
        self._known = planned.edges, roads
        return roads

    def along(self, api: Api, route: tuple[str, ...]) -> tuple[RoadNetwork, SignMap]:
        """Roads and signs along the ego's route in a simulation that runs."""
        if self._known is not None and self._known[0] == route:
            return self._known[1]
        net = self.net(api)
        unknown = [edge for edge in route if edge not in net.edges]
        if unknown:
            near = ", ".join(nearest_of(unknown[0], net.edges, _NEAREST))
            raise InputError(
                f"{self._file or loaded_net(api)}: the ego drives on edge {shown(unknown[0])}, which this network does "
                f"not have (nearest: {near}); name the network that SUMO has loaded"
            )
        network = road_network(net, route, self.structures(api))
        self._known = route, (network, sign_map(net, self._additional or loaded_additional(api)))
        return self._known[1]

    def net(self, api: Api) -> RoadMap:
        """The network."""
        if self._net is None:
            self._net = read_net(self._file or loaded_net(api))
        return self._net

    def structures(self, api: Api) -> tuple[Structure, ...]:
        """What stands next to the roads."""
        if self._structures is None:
            files = self._additional or loaded_additional(api)
            self._structures = structures(path for path in files if path.is_file())
        return self._structures
