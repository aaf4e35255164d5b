"""From the fog of a scenario file to a fog field along the ego's route, in SI units."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.scenario.fog_schema import Bank, Fog, Patches, Wind
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim.values import FogBank, FogChange, FogField, FogPatches


def fog_along(fog: Fog, airlight: tuple[float, float, float], route: NDArray[np.float64]) -> FogField:
    """Fog laid along a route.

    Parameters
    ----------
    fog : Fog
        What the scenario says.
    airlight : tuple of float
        Airlight near the ground per channel [cd/m²].
    route : (n, 3) float64
        Polyline along the route [m].
    """
    visibility = fog.visibility_m if fog.visibility_m is not None else fog.outside_visibility_m
    outside = extinction_from_visibility(math.inf if visibility is None else visibility)
    ground = float(route[:, 2].min())
    return FogField(
        extinction=outside,
        airlight=airlight,
        banks=tuple(_bank(bank, outside, route) for bank in fog.banks),
        top=ground + fog.top_m,
        top_edge=fog.top_edge_m,
        base=-math.inf if fog.base_m is None else ground + fog.base_m,
        base_edge=fog.base_edge_m,
        scale_height=fog.scale_height_m or math.inf,
        ground=ground,
        patches=None if fog.patches is None else _patches(fog.patches),
        wind=(0.0, 0.0) if fog.wind is None else _velocity(fog.wind),
        changes=_changes(fog, ground),
        airlight_shading=fog.airlight_shading,
        forward_scatter=fog.forward_scatter,
        forward_scatter_width=math.radians(fog.forward_scatter_deg),
    )


def _changes(fog: Fog, ground: float) -> tuple[FogChange, ...]:
    changes = []
    for change in fog.changes:
        base, top = fog.heights(change)
        lifted = -math.inf if base is None else ground + base
        changes.append(FogChange(change.at_s, change.density, lifted, ground + top))
    return tuple(changes)


def _patches(patches: Patches) -> FogPatches:
    return FogPatches(patches.correlation_length_m, patches.correlation_height_m, patches.strength, patches.seed)


def _velocity(wind: Wind) -> tuple[float, float]:
    """East and north components [m/s]; wind is named by where it comes from."""
    speed, bearing = wind.speed_kmh / KMH_PER_MPS, math.radians(wind.from_deg)
    return -speed * math.sin(bearing), -speed * math.cos(bearing)


def _bank(bank: Bank, outside: float, route: NDArray[np.float64]) -> FogBank:
    """A bank between two places of the route: a slab across the straight line that joins them."""
    station = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(route, axis=0), axis=1))))

    def place(at: float) -> NDArray[np.float64]:
        inside = np.array([np.interp(at, station, route[:, axis]) for axis in (0, 1)])
        # Before the start and beyond the end of the route, go straight on.
        first, last = route[1, :2] - route[0, :2], route[-1, :2] - route[-2, :2]
        before, beyond = min(at, 0.0), max(at - station[-1], 0.0)
        return np.asarray(inside + before * first / math.hypot(*first) + beyond * last / math.hypot(*last))

    start, end = place(bank.start_m), place(bank.end_m)
    chord = math.dist(start, end)
    axis = (end - start) / chord
    return FogBank(
        origin=(float(start[0]), float(start[1])),
        axis=(float(axis[0]), float(axis[1])),
        start=0.0,
        end=chord,
        edge=min(bank.edge_m, chord),
        extra_extinction=extinction_from_visibility(bank.visibility_m) - outside,
    )
