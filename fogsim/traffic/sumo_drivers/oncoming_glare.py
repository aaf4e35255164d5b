"""Glare of head lamps that come toward a driver on the other side of the road, and of high beams in the mirrors."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.lamp_intensity import beam_intensity, head_lamps_that_burn, uses_high_beam
from fogsim.traffic.sumo.link import getter, vehicle_getter
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps
from fogsim.traffic.sumo_lanes.directions import LaneDirections, OppositeEdges
from fogsim.units import DAY_ILLUMINANCE
from fogsim.values.eye import disability_glare

_FARTHEST_SOURCE = 200.0
"""Lamps farther away than this are left out [m]."""

_DEEPEST_SOURCE = 5.0
"""Lamps behind fog of more than this optical depth are left out [-]: less than 1 % of their light comes through."""

MOST_GLARE = 10.0
"""A veil of glare counts up to this [cd/m²]: the low beams of one car on the next lane
lay 0.2 … 0.3 cd/m² over the eye, high beams 10 and more."""

LAMP_HEIGHT = 0.65
"""Of head lamps above the road [m]."""

MIRROR_ANGLE, MIRROR_SHARE = math.radians(40.0), 0.8
"""Where a driver sees what is behind, from straight ahead [rad], and how much of its light [-]: the mirror inside and
that next to the driver at about 40° to either side, of the 40 % each that UNECE R46 asks for at least."""

_Point = tuple[float, float, float]


def most_glare(illuminance: float) -> float:
    """Most veil of glare that there can be [cd/m²]; none by day, when it is nothing next to the airlight."""
    return 0.0 if illuminance >= DAY_ILLUMINANCE else MOST_GLARE


class OncomingGlare:
    """Computes the veil that oncoming head lamps lay over drivers' eyes."""

    def __init__(self, view: DriversView) -> None:
        api, self._fog, self._vehicles, self._extinction = view.api, view.fog, view.vehicles, view.extinction
        self._farthest = min(_FARTHEST_SOURCE, _DEEPEST_SOURCE / max(view.fog.minimum_extinction, 1e-6))
        self._opposite, self._directions = OppositeEdges(api), LaneDirections(api)
        self._lane, self._road = vehicle_getter(api, "getLaneID"), vehicle_getter(api, "getRoadID")
        self._on_edge = getter(api, "edge", "getLastStepVehicleIDs")
        self._position, self._angle = view.getters("getPosition3D", "getAngle")

    def veil(self, observer: str, target: str, own_lamps: OwnLamps) -> float:
        """Veil inside an observer's eyes who looks at a target [cd/m²], at most `MOST_GLARE`."""
        edges = {e for vehicle in (observer, target) for e in self._oncoming_edges(vehicle)}
        oncoming = [v for edge in sorted(edges) for v in self._on_edge(edge)]
        veil = self._veil_of(observer, target, oncoming, own_lamps) if oncoming else 0.0
        dazzling = [v for v, lamps in own_lamps.items() if v != observer and uses_high_beam(lamps)]
        return min(veil + self._veil_in_mirrors(observer, dazzling, own_lamps), MOST_GLARE) if dazzling else veil

    def _oncoming_edges(self, vehicle: str) -> tuple[str, ...]:
        """Edges on which others come toward a vehicle: its own while it overtakes on the oncoming lane."""
        road = self._road(vehicle)
        opposite = self._opposite.of(road)
        return (road,) if opposite and self._directions.is_against(vehicle, self._lane(vehicle)) else opposite

    def _veil_in_mirrors(self, observer: str, dazzling: Sequence[str], own_lamps: OwnLamps) -> float:
        """Veil of high beams that follow an observer on the same road [cd/m²]."""
        x, y, z = self._position(observer)
        eyes, heading = (x, y, z + self._vehicles.body(observer).eye_height), math.radians(90.0 - self._angle(observer))
        total = 0.0
        for vehicle in dazzling:
            if vehicle not in self._on_edge(self._road(observer)):
                continue
            lamp_x, lamp_y, lamp_z = self._position(vehicle)
            lamp = lamp_x, lamp_y, lamp_z + LAMP_HEIGHT
            distance = math.dist(eyes, lamp)
            behind = (x - lamp_x) * math.cos(heading) + (y - lamp_y) * math.sin(heading)
            if not 0.0 < behind <= distance < self._farthest:
                continue
            off_axis = math.degrees(math.acos(behind / distance))
            light = sum(beam_intensity(lit, off_axis) for lit in head_lamps_that_burn(own_lamps[vehicle]))
            light *= MIRROR_SHARE * math.exp(-float(self._optical_depths(eyes, [lamp])[0])) / distance**2
            total += float(disability_glare(light, MIRROR_ANGLE))
        return total

    def _veil_of(self, observer: str, target: str, oncoming: Sequence[str], own_lamps: OwnLamps) -> float:
        x, y, z = self._position(observer)
        height = self._vehicles.body(observer).eye_height
        target_x, target_y, _ = self._position(target)
        looking = math.atan2(target_y - y, target_x - x)
        ends: list[_Point] = []
        light: list[float] = []
        angles: list[float] = []
        for vehicle in oncoming:
            lamp_x, lamp_y, lamp_z = self._position(vehicle)
            distance = math.dist((x, y, z + height), (lamp_x, lamp_y, lamp_z + LAMP_HEIGHT))
            bearing = math.atan2(lamp_y - y, lamp_x - x)
            angle = abs(math.remainder(bearing - looking, math.tau))
            if not 0.0 < distance < self._farthest or angle > 0.5 * math.pi:
                continue
            off_axis = abs(math.remainder(bearing + math.pi - math.radians(90.0 - self._angle(vehicle)), math.tau))
            lamps = self._vehicles.lamps(vehicle, own_lamps)
            pair = head_lamps_that_burn(lamps)
            if pair and off_axis < 0.5 * math.pi:
                ends.append((lamp_x, lamp_y, lamp_z + LAMP_HEIGHT))
                light.append(sum(beam_intensity(lit, math.degrees(off_axis)) for lit in pair) / distance**2)
                angles.append(angle)
        if not ends:
            return 0.0
        dimmed = light * np.exp(-self._optical_depths((x, y, z + height), ends))
        return min(float(disability_glare(dimmed, angles).sum()), MOST_GLARE)

    def _optical_depths(self, eyes: _Point, ends: Sequence[_Point]) -> NDArray[np.float64]:
        if self._extinction is not None:
            return self._extinction * np.array([math.dist(eyes, end) for end in ends])
        return self._fog.optical_depth([eyes] * len(ends), ends)
