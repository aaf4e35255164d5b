"""Foes at junctions, as SUMO reports them, and none where it cannot.

Where no one has the right of way (junctions of type ``unregulated``, also those that netconvert makes so since they
have too many lanes), no one yields; SUMO 1.28 ends with a segmentation fault if it is asked for foes there.
"""

import functools
import re
from collections.abc import Sequence
from pathlib import Path

from fogsim.core.files.xml_reader import open_unpacked
from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo_lanes.route_position import RoutePlaces

Foe = tuple[str, float, float, float, float, str, str, bool, bool]
"""SUMO's answer: foe, ways of driver and foe to where they cross, and so on; see libsumo's ``getJunctionFoes``."""

_JUNCTION = re.compile(rb'<junction\s[^>]*\btype="(?:traffic_light_)?unregulated"[^>]*>')
_ID = re.compile(rb'\bid="([^"]*)"')


class JunctionFoes:
    """Asks SUMO for foes at junctions."""

    def __init__(self, api: Api, net: Path | None = None) -> None:
        self._api = api
        self._net = net
        self._foes = vehicle_getter(api, "getJunctionFoes")
        self._vehicles, self._places = api.vehicle, RoutePlaces(api)
        self._lanes = api.lane
        self._lengths: dict[str, float] = {}

    @functools.cached_property
    def _unregulated(self) -> frozenset[str]:
        # Only in fog need the file be read.
        return unregulated_junctions(self._net or Path(self._api.simulation.getOption("net-file")))

    @functools.cached_property
    def _leading_there(self) -> frozenset[str]:
        get = self._api.junction.getIncomingEdges
        return frozenset(edge for name in self._unregulated for edge in get(name))

    def ahead_of(self, driver: str, reach: float) -> Sequence[Foe]:
        """Foes of a driver at the junctions within reach (`reach` [m])."""
        if self._leading_there and self._meets_unregulated(driver, reach):
            return ()
        foes: Sequence[Foe] = self._foes(driver, reach)
        return foes

    def _meets_unregulated(self, driver: str, reach: float) -> bool:
        vehicles = self._vehicles
        road = str(vehicles.getRoadID(driver))
        if road.startswith(":") and road[1:].rpartition("_")[0] in self._unregulated:
            return True
        way = -self._places.find(driver).station
        for edge in vehicles.getRoute(driver)[max(int(vehicles.getRouteIndex(driver)), 0) :]:
            if edge in self._leading_there:
                return True
            way += self._length(edge)
            if way > reach:
                return False
        return False

    def _length(self, edge: str) -> float:
        known = self._lengths.get(edge)
        if known is None:
            known = self._lengths[edge] = float(self._lanes.getLength(f"{edge}_0"))
        return known


def unregulated_junctions(net: Path) -> frozenset[str]:
    """Junctions of a network at which no one has the right of way; none if there is no such file here."""
    if not net.is_file():
        return frozenset()
    with open_unpacked(net) as source:
        tags = _JUNCTION.findall(source.read())
    return frozenset(found[1].decode() for tag in tags if (found := _ID.search(tag)))
