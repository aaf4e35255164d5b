"""The truth about the fog around a camera, which estimators never see."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import distance_at_depth, extinction
from fogsim.core.jit import kernel
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Camera, CameraPose, Fault, FogField, Lane, LaneKind, RoadSection, SignMap, TrafficState, Truth
from fogsim.values.belief import THINNEST, FogProfile

_SIGHT_LINE = np.geomspace(1.0, 20_000.0, 400)
"""Distances ahead at which the optical depth is looked up to find how far one sees [m]."""

_EYES = np.array([0.0, 0.0, 1.2])
"""Where eyes are above the road, whatever the vehicle [m]; fog over a road changes little over a truck's height."""


_WAY = np.arange(-200.0, 1001.0, 25.0)
"""Distances ahead along the route at which the true fog is reported [m]."""

_NO_PLACES = np.empty((0, 3))


@dataclass(frozen=True)
class KnownWay:
    """What of the road does not change in a run."""

    route: NDArray[np.float64] | None = None  # (n, 3): Polyline along the ego's route [m]
    # Lanes for vehicles of each edge, from `carriageways`
    carriageways: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @cached_property
    def stations(self) -> NDArray[np.float64]:
        """Distance of each point of the route from its start [m]."""
        steps = np.diff(np.zeros((1, 3)) if self.route is None else self.route, axis=0)
        return np.concatenate(([0.0], np.cumsum(np.linalg.norm(steps, axis=1))))


def fog_truth(
    fog: FogField,
    pose: CameraPose,
    camera: Camera,
    signs: SignMap,
    traffic: TrafficState | None = None,
    sections: tuple[RoadSection, ...] = (),
    way: KnownWay | None = None,
    faults: tuple[Fault, ...] = (),
    place: float | None = None,
    illuminance: float | None = None,
) -> Truth:
    """The fog at a camera, and as far as it sees along its heading, parallel to the road under it.

    Takes `place` [m] and `illuminance` [lx].
    """
    eye, level = np.array(pose.position), math.cos(pose.road_grade)
    direction = np.array([math.cos(pose.heading) * level, math.sin(pose.heading) * level, math.sin(pose.road_grade)])
    sight = distance_at_depth(fog, eye, direction, _SIGHT_LINE, OPTICAL_DEPTH_AT_VISIBILITY)
    on_way = None if way is None or place is None else _way_places(way, place)
    way_places = _NO_PLACES if on_way is None else on_way[1]
    drivers = _NO_PLACES if traffic is None else traffic.position
    first = 1 + len(drivers)
    places = np.empty((first + len(way_places), 3))
    places[0] = eye
    np.add(drivers, _EYES, out=places[1:first])
    np.add(way_places, _EYES, out=places[first:])
    found = extinction(fog, places)
    return Truth(
        extinction=float(found[0]),
        extinction_ahead=OPTICAL_DEPTH_AT_VISIBILITY / sight,
        camera=camera,
        pose=pose,
        fog=fog,
        signs=signs,
        sections=sections,
        route=None if way is None else way.route,
        carriageways={} if way is None else way.carriageways,
        faults=faults,
        vehicle_extinctions=None if traffic is None else found[1:first],
        profile=None if on_way is None else _profile(on_way[0], found[first:]),
        illuminance=illuminance,
    )


def _way_places(way: KnownWay, place: float) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Those of `_WAY` about a place that are on the route (n,), and their places (n, 3) [m]; None without a route."""
    if way.route is None:
        return None
    stations, at = way.stations, place + _WAY
    if at[0] >= 0.0 and at[-1] <= stations[-1]:
        return _WAY.copy(), _places(way.route, stations, at)
    is_there = (at >= 0.0) & (at <= stations[-1])
    return _WAY[is_there], _places(way.route, stations, at[is_there])


def _profile(ahead: NDArray[np.float64], known: NDArray[np.float64]) -> FogProfile:
    return FogProfile(ahead, np.log(np.maximum(known, THINNEST)), np.zeros(ahead.size))


@kernel
def _places(route: NDArray[np.float64], stations: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places (m, 3) on a route at distances from its start (m,) [m], as `numpy.interp` has each of their numbers."""
    out = np.empty((at.size, 3))
    for i in range(at.size):
        low = np.searchsorted(stations, at[i], "right") - 1
        for axis in range(3):
            out[i, axis] = route[low, axis]
            if low + 1 < stations.size:
                slope = (route[low + 1, axis] - route[low, axis]) / (stations[low + 1] - stations[low])
                out[i, axis] = slope * (at[i] - stations[low]) + route[low, axis]
    return out


def carriageways(lanes: Iterable[Lane]) -> dict[str, tuple[str, ...]]:
    """Ids of the lanes for vehicles of each edge, from the right."""
    found: dict[str, list[str]] = {}
    for lane in lanes:
        if lane.kind is LaneKind.CARRIAGEWAY:
            found.setdefault(lane.edge_id, []).append(lane.lane_id)
    return {edge: tuple(sorted(ids, key=_number_from_right)) for edge, ids in found.items()}


def _number_from_right(lane_id: str) -> int:
    number = lane_id.rpartition("_")[2]
    return int(number) if number.isdecimal() else 0
