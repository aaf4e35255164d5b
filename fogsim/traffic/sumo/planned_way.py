"""The ego's way as the files of a simulation have it, before SUMO is started."""

from pathlib import Path
from typing import NamedTuple

from fogsim.errors import InputError
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.road.demand import read_configured_demand, read_demand
from fogsim.traffic.setup import TrafficSetup


class PlannedWay(NamedTuple):
    """Where the ego drives."""

    net: Path  # Network
    additional: tuple[Path, ...]  # Files with what stands next to the road
    edges: tuple[str, ...]  # Ids of the edges that the ego drives on


def planned_way(setup: TrafficSetup) -> PlannedWay | None:
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
    return None if way is None else PlannedWay(net, additional, way.edges)
